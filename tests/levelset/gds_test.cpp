#include "levelset/gds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>

#include "core/error.h"
#include "core/temporary_folder.h"

namespace scarp {
namespace {

using testing::HasSubstr;

namespace fs = std::filesystem;

/// Writes records; database unit 1 nm.
class GdsWriter {
 public:
  GdsWriter() {
    shorts(0x00, {600});
    shorts(0x01, std::vector<int>(12, 0));
    text(0x02, "LIB");
    reals(0x03, {1e-3, 1e-9});
  }
  void record(int kind, int type, const std::string& body) {
    const std::size_t length = body.size() + 4;
    bytes_ += static_cast<char>(length >> 8);
    bytes_ += static_cast<char>(length & 0xff);
    bytes_ += static_cast<char>(kind);
    bytes_ += static_cast<char>(type);
    bytes_ += body;
  }
  void shorts(int kind, const std::vector<int>& values) { record(kind, 2, integers(values, 2)); }
  void longs(int kind, const std::vector<int>& values) { record(kind, 3, integers(values, 4)); }
  void text(int kind, std::string value) {
    if (value.size() % 2 != 0) value += '\0';
    record(kind, 6, value);
  }
  void reals(int kind, const std::vector<double>& values) {
    std::string body;
    for (const double value : values) {
      int exponent = 0;
      double mantissa = std::abs(value);
      while (mantissa >= 1) mantissa /= 16, ++exponent;
      while (mantissa > 0 && mantissa < 1.0 / 16) mantissa *= 16, --exponent;
      auto bits = static_cast<std::uint64_t>(std::ldexp(mantissa, 56));
      bits |= static_cast<std::uint64_t>(exponent + 64) << 56;
      if (value < 0) bits |= std::uint64_t{1} << 63;
      for (int shift = 56; shift >= 0; shift -= 8) body += static_cast<char>(bits >> shift & 0xff);
    }
    record(kind, 5, body);
  }
  void cell(const std::string& name, const std::function<void()>& elements) {
    shorts(0x05, std::vector<int>(12, 0));
    text(0x06, name);
    elements();
    record(0x07, 0, "");
  }
  void boundary(int layer, int datatype, const std::vector<int>& xy) {
    record(0x08, 0, "");
    shorts(0x0d, {layer});
    shorts(0x0e, {datatype});
    longs(0x10, xy);
    record(0x11, 0, "");
  }
  void rectangle(int layer, int x0, int y0, int x1, int y1) {
    boundary(layer, 0, {x0, y0, x1, y0, x1, y1, x0, y1, x0, y0});
  }
  void path(int layer, int type, int width, const std::vector<int>& xy) {
    record(0x09, 0, "");
    shorts(0x0d, {layer});
    shorts(0x0e, {0});
    shorts(0x21, {type});
    longs(0x0f, {width});
    if (type == 4) {
      longs(0x30, {10});
      longs(0x31, {20});
    }
    longs(0x10, xy);
    record(0x11, 0, "");
  }
  void box(int layer, int x0, int y0, int x1, int y1) {
    record(0x2d, 0, "");
    shorts(0x0d, {layer});
    shorts(0x2e, {0});
    longs(0x10, {x0, y0, x1, y0, x1, y1, x0, y1, x0, y0});
    record(0x11, 0, "");
  }
  struct Turn {
    bool mirrored = false;
    double magnification = 1;
    double angle = 0;
  };
  void reference(const std::string& name, const std::vector<int>& xy, const Turn& turn,
                 const std::vector<int>& columns_rows = {}) {
    record(columns_rows.empty() ? 0x0a : 0x0b, 0, "");
    text(0x12, name);
    shorts(0x1a, {turn.mirrored ? 0x8000 : 0});
    reals(0x1b, {turn.magnification});
    reals(0x1c, {turn.angle});
    if (!columns_rows.empty()) shorts(0x13, columns_rows);
    longs(0x10, xy);
    record(0x11, 0, "");
  }
  std::string finish() {
    record(0x04, 0, "");
    return bytes_;
  }

 private:
  static std::string integers(const std::vector<int>& values, int size) {
    std::string body;
    for (const int value : values) {
      for (int shift = 8 * (size - 1); shift >= 0; shift -= 8) {
        body += static_cast<char>(static_cast<unsigned>(value) >> shift & 0xff);
      }
    }
    return body;
  }
  std::string bytes_;
};

class Gds : public testing::Test {
 protected:
  std::vector<Loop> read(const std::string& bytes, const GdsSelection& selection) const {
    std::ofstream(file_, std::ios::binary) << bytes;
    return read_gds(file_, selection);
  }

  std::string message(const std::string& bytes, const GdsSelection& selection) const {
    try {
      read(bytes, selection);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(file_.string()));
      return error.what();
    }
    return "accepted";
  }

  /// Area of the union.
  static double area_of(const std::vector<Loop>& loops) {
    const Frame frame{.spacing = 1, .cells = {4000, 4000}};
    return area(domain_loops(frame, {loops, PolygonOutline::Rule::any}));
  }

  TemporaryFolder folder_;
  fs::path file_ = folder_ / "layout.gds";
};

TEST_F(Gds, BoundariesAndBoxesOfTheLayerAreRead) {
  GdsWriter gds;
  gds.cell("TOP", [&] {
    gds.rectangle(7, 0, 0, 100, 50);
    gds.box(7, 200, 0, 260, 10);
    gds.boundary(7, 5, {-300, 0, -200, 0, -200, 100, -300, 0});
    gds.rectangle(8, 0, 0, 1000, 1000);
  });
  const std::string bytes = gds.finish();
  EXPECT_NEAR(area_of(read(bytes, {.layer = 7})), 5000 + 600 + 5000, 1e-6);
  EXPECT_NEAR(area_of(read(bytes, {.layer = 7, .datatype = 5})), 5000, 1e-6);
  EXPECT_EQ(read(bytes, {.cell = "TOP", .layer = 8})[0],
            (Loop{{0, 0}, {1000, 0}, {1000, 1000}, {0, 1000}}));
}

TEST_F(Gds, PathsHaveTheirWidthAndEnds) {
  const auto area_with = [&](int type) {
    GdsWriter gds;
    gds.cell("TOP", [&] { gds.path(1, type, 40, {0, 0, 200, 0, 200, 300}); });
    return area_of(read(gds.finish(), {.layer = 1}));
  };
  // The mitred corner: the lengths along the middle line count.
  const double flush = 40.0 * 500;
  EXPECT_NEAR(area_with(0), flush, 1e-6);
  EXPECT_NEAR(area_with(2), flush + 2 * 40 * 20, 1e-6);
  EXPECT_NEAR(area_with(4), flush + 40 * 30, 1e-6);
  EXPECT_NEAR(area_with(1), flush + 3.14159 * 400, 5);
}

TEST_F(Gds, ReferencesTurnMirrorAndMagnify) {
  // An L-shaped cell, so that every way round gives different points.
  const auto placed = [&](const GdsWriter::Turn& turn) {
    GdsWriter gds;
    gds.cell("L", [&] { gds.boundary(1, 0, {0, 0, 30, 0, 30, 10, 0, 0}); });
    gds.cell("TOP", [&] { gds.reference("L", {100, 200}, turn); });
    return read(gds.finish(), {.layer = 1})[0];
  };
  EXPECT_EQ(placed({}), (Loop{{100, 200}, {130, 200}, {130, 210}}));
  EXPECT_EQ(placed({.angle = 90}), (Loop{{100, 200}, {100, 230}, {90, 230}}));
  EXPECT_EQ(placed({.mirrored = true}), (Loop{{100, 200}, {130, 200}, {130, 190}}));
  EXPECT_EQ(placed({.mirrored = true, .angle = 90}), (Loop{{100, 200}, {100, 230}, {110, 230}}));
  EXPECT_EQ(placed({.magnification = 2, .angle = 180}), (Loop{{100, 200}, {40, 200}, {40, 180}}));
  const Loop slanted = placed({.angle = 30});
  EXPECT_NEAR(slanted[1][0], 100 + 30 * std::sqrt(0.75), 1e-9);
  EXPECT_NEAR(slanted[1][1], 215, 1e-9);
}

TEST_F(Gds, ArraysOfArraysAreWrittenOut) {
  GdsWriter gds;
  gds.cell("DOT", [&] { gds.rectangle(1, 0, 0, 4, 4); });
  gds.cell("ROW", [&] { gds.reference("DOT", {0, 0, 60, 0, 0, 20}, {}, {3, 2}); });
  gds.cell("TOP", [&] { gds.reference("ROW", {0, 0, 400, 0, 0, 300}, {.angle = 90}, {2, 3}); });
  const std::vector<Loop> loops = read(gds.finish(), {.layer = 1});
  EXPECT_EQ(loops.size(), 36U);
  EXPECT_NEAR(area_of(loops), 36 * 16, 1e-6);
}

TEST_F(Gds, EveryTruncatedFileIsRefused) {
  GdsWriter gds;
  gds.cell("TOP", [&] { gds.rectangle(1, 0, 0, 4, 4); });
  const std::string bytes = gds.finish();
  for (std::size_t length = 6; length < bytes.size(); ++length) {
    EXPECT_THAT(message(bytes.substr(0, length), {.layer = 1}), HasSubstr("ends early")) << length;
  }
}

TEST_F(Gds, WhatIsMissingIsSaid) {
  GdsWriter gds;
  gds.cell("TOP", [&] { gds.rectangle(1, 0, 0, 4, 4); });
  gds.cell("OTHER", [&] { gds.rectangle(2, 0, 0, 4, 4); });
  const std::string bytes = gds.finish();
  EXPECT_THAT(message(bytes, {.cell = "TOPP", .layer = 1}),
              HasSubstr("has no cell TOPP (did you mean TOP?); it has "));
  EXPECT_THAT(message(bytes, {.cell = "TOP", .layer = 3}),
              HasSubstr("cell TOP has nothing on layer 3; it has layer/datatype 1/0"));
  EXPECT_THAT(message(bytes, {.layer = 1}), HasSubstr("choose one with cell = ...: OTHER, TOP"));
  EXPECT_THAT(message("solid cube\n", {.layer = 1}), HasSubstr("is not a GDSII file"));
}

TEST_F(Gds, ACellThatContainsItselfIsRefused) {
  GdsWriter gds;
  gds.cell("A", [&] { gds.reference("B", {0, 0}, {}); });
  gds.cell("B", [&] { gds.reference("A", {5, 0}, {}); });
  EXPECT_THAT(message(gds.finish(), {.cell = "A", .layer = 1}), HasSubstr("contains itself"));
}

TEST_F(Gds, CellsNestUpToALimit) {
  const auto chain = [](int length) {
    GdsWriter gds;
    for (int n = 0; n < length; ++n) {
      gds.cell(std::to_string(n), [&] {
        if (n > 0) gds.reference(std::to_string(n - 1), {0, 0}, {});
        if (n == 0) gds.rectangle(1, 0, 0, 4, 4);
      });
    }
    return gds.finish();
  };
  EXPECT_EQ(read(chain(200), {.layer = 1}).size(), 1U);
  EXPECT_THAT(message(chain(201), {.layer = 1}), HasSubstr("200 or more references"));
  EXPECT_THAT(message(chain(20'000), {.layer = 1}), HasSubstr("200 or more references"));
}

/// Arrays of arrays: 10^45 placements of a cell, besides one rectangle of layer 1.
std::string endless_layout(const std::function<void(GdsWriter&)>& innermost) {
  GdsWriter gds;
  gds.cell("C0", [&] { innermost(gds); });
  for (int n = 1; n <= 5; ++n) {
    gds.cell("C" + std::to_string(n), [&] {
      gds.reference("C" + std::to_string(n - 1), {0, 0, 9, 0, 0, 9}, {}, {32767, 32767});
    });
  }
  gds.cell("TOP", [&] {
    gds.reference("C5", {0, 0}, {});
    gds.rectangle(1, 0, 0, 4, 4);
  });
  return gds.finish();
}

TEST_F(Gds, CellsWithoutTheLayerAreNotWrittenOut) {
  const std::string other = endless_layout([](GdsWriter& gds) { gds.rectangle(2, 0, 0, 4, 4); });
  EXPECT_EQ(read(other, {.layer = 1}).size(), 1U);
  EXPECT_THAT(message(other, {.layer = 3}), HasSubstr("it has layer/datatype 1/0, 2/0"));
  EXPECT_EQ(read(endless_layout([](GdsWriter&) {}), {.layer = 1}).size(), 1U);
  // A line without a width draws nothing.
  const auto line = [](GdsWriter& gds) { gds.path(1, 0, 0, {0, 0, 9, 0}); };
  EXPECT_EQ(read(endless_layout(line), {.layer = 1}).size(), 1U);
}

TEST_F(Gds, MoreShapesThanALayoutHasAreRefusedBeforeTheyAreWrittenOut) {
  EXPECT_THAT(
      message(endless_layout([](GdsWriter& gds) { gds.rectangle(1, 0, 0, 4, 4); }), {.layer = 1}),
      HasSubstr("more than 1000000 shapes"));
}

TEST_F(Gds, PointsBeyondAMetreAreRefused) {
  GdsWriter gds;
  gds.cell("DOT", [&] { gds.rectangle(1, 0, 0, 4, 4); });
  gds.cell("TOP", [&] { gds.reference("DOT", {0, 0}, {.magnification = 1e60}); });
  EXPECT_THAT(message(gds.finish(), {.layer = 1}), HasSubstr("more than 1 m away"));
}

}  // namespace
}  // namespace scarp
