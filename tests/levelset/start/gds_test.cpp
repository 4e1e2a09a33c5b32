#include "levelset/start/gds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>

#include "core/error.h"
#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"
#include "tests/levelset/gds_writer.h"

namespace scarp {
namespace {

using testing::HasSubstr;

namespace fs = std::filesystem;

class Gds : public testing::Test {
 protected:
  std::vector<Loop> read(const std::string& bytes, const GdsSelection& selection) const {
    return layout(bytes, selection).loops;
  }

  Layout layout(const std::string& bytes, const GdsSelection& selection) const {
    std::ofstream(file_, std::ios::binary) << bytes;
    return read_gds(file_, read_file(file_), selection);
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

TEST_F(Gds, OfArraysOnlyWhatReachesIntoTheWindowIsWrittenOut) {
  // 10^9 dots 100 nm apart, the lattice leaning and mirrored by turns.
  for (const GdsWriter::Turn& turn :
       {GdsWriter::Turn{}, {.angle = 30}, {.mirrored = true, .magnification = 2, .angle = 135}}) {
    GdsWriter gds;
    gds.cell("DOT", [&] { gds.rectangle(1, 0, 0, 10, 10); });
    gds.cell("ROW", [&] {
      gds.reference("DOT", {0, 0, 100 * 30000, 0, 0, 100 * 30000}, {}, {30000, 30000});
    });
    gds.cell("TOP", [&] { gds.reference("ROW", {0, 0}, turn); });
    const double m = turn.magnification;
    // Around the dot in row and column 200.
    const double angle = turn.angle * 3.14159265358979 / 180;
    const double y = (turn.mirrored ? -1 : 1) * 20000.0 * m;
    const Point2 middle{20000.0 * m * std::cos(angle) - y * std::sin(angle),
                        20000.0 * m * std::sin(angle) + y * std::cos(angle)};
    const auto around = [&](double reach) {
      return std::array<Point2, 2>{
          {{middle[0] - reach, middle[1] - reach}, {middle[0] + reach, middle[1] + reach}}};
    };
    const std::string bytes = gds.finish();
    EXPECT_EQ(read(bytes, {.layer = 1, .window = around(40)}).size(), 1U);
    const std::size_t many = read(bytes, {.layer = 1, .window = around(1000 * m)}).size();
    EXPECT_NEAR(static_cast<double>(many), 400, 60);
    const Layout nothing =
        layout(bytes, {.layer = 1, .window = std::array<Point2, 2>{{{-2e9, -2e9}, {-1e9, -1e9}}}});
    EXPECT_TRUE(nothing.loops.empty());
    EXPECT_GT(nothing.extent[1][0] - nothing.extent[0][0], 2.9e6);
  }
}

TEST_F(Gds, APathOfNoLengthIsItsEnds) {
  const auto area_with = [&](int type) {
    GdsWriter gds;
    gds.cell("TOP", [&] { gds.path(1, type, 40, {50, 60, 50, 60}); });
    return area_of(read(gds.finish(), {.layer = 1}));
  };
  EXPECT_NEAR(area_with(1), 3.14159 * 400, 1);
  EXPECT_NEAR(area_with(2), 1600, 1e-6);
  EXPECT_NEAR(area_with(4), 40 * 30, 1e-6);
  GdsWriter gds;
  gds.cell("TOP", [&] {
    gds.path(1, 0, 40, {50, 60});
    gds.path(1, 2, 0, {0, 0, 9, 0});
    gds.boundary(1, 0, {0, 0, 9, 0, 5, 0, 0, 0});
    gds.rectangle(2, 0, 0, 4, 4);
  });
  const std::string bytes = gds.finish();
  EXPECT_THAT(message(bytes, {.layer = 1}),
              HasSubstr("cell TOP has on layer 1 only shapes without area (3)"));
}

TEST_F(Gds, ShapesWithoutAreaBesideOthersAreTold) {
  GdsWriter gds;
  gds.cell("TOP", [&] {
    gds.path(1, 0, 0, {0, 0, 9, 0});
    gds.rectangle(1, 0, 0, 4, 4);
  });
  EXPECT_THAT(layout(gds.finish(), {.layer = 1}).doubts,
              testing::ElementsAre(HasSubstr("has a shape without area on layer 1")));
}

TEST_F(Gds, NumbersGoUpTo65535) {
  GdsWriter gds;
  gds.cell("DOT", [&] { gds.boundary(40000, 65535, {0, 0, 4, 0, 4, 4, 0, 4}); });
  gds.cell("TOP", [&] { gds.reference("DOT", {0, 0, 400000, 0, 0, 10}, {}, {40000, 1}); });
  const std::string bytes = gds.finish();
  EXPECT_EQ(read(bytes, {.layer = 40000, .datatype = 65535}).size(), 40000U);
  EXPECT_THAT(message(bytes, {.layer = 1}), HasSubstr("it has layer/datatype 40000/65535"));
}

TEST_F(Gds, SeveralDatatypesAreTold) {
  GdsWriter gds;
  gds.cell("TOP", [&] {
    gds.rectangle(1, 0, 0, 4, 4);
    gds.boundary(1, 7, {10, 0, 14, 0, 14, 4, 10, 4});
  });
  const std::string bytes = gds.finish();
  EXPECT_THAT(layout(bytes, {.layer = 1}).doubts,
              testing::ElementsAre(HasSubstr("layer 1 in datatypes 0, 7: all of them are taken")));
  EXPECT_TRUE(layout(bytes, {.layer = 1, .datatype = 7}).doubts.empty());
}

TEST_F(Gds, AnAbsurdDatabaseUnitIsTold) {
  GdsWriter gds(1e-3, 1e-9);
  GdsWriter swapped(1e-9, 1e-3);
  for (GdsWriter* const each : {&gds, &swapped})
    each->cell("TOP", [&] { each->rectangle(1, 0, 0, 200, 200); });
  EXPECT_TRUE(layout(gds.finish(), {.layer = 1}).doubts.empty());
  EXPECT_THAT(layout(swapped.finish(), {.layer = 1}).doubts,
              testing::ElementsAre(HasSubstr("a database unit of 1e+06 nm, and layer 1 of cell TOP "
                                             "is 2e+08 nm wide; are its two units swapped?")));
}

TEST_F(Gds, TwoCellsOfOneNameAreRefused) {
  GdsWriter gds;
  gds.cell("TOP", [&] { gds.rectangle(1, 0, 0, 4, 4); });
  gds.cell("TOP", [&] { gds.rectangle(1, 10, 0, 14, 4); });
  EXPECT_THAT(message(gds.finish(), {.layer = 1}), HasSubstr("two cells that are named TOP"));
}

TEST_F(Gds, NamesOfCellsAreShownOnOneLine) {
  GdsWriter gds;
  for (const char* name : {"A", "B", "C", "D", "E", "F", "G", "H", "I", "J"})
    gds.cell(std::string(name) + "\nx", [&] { gds.rectangle(1, 0, 0, 4, 4); });
  gds.cell("K", [&] { gds.rectangle(1, 0, 0, 4, 4); });
  const std::string bytes = gds.finish();
  for (const char* cell : {"", "L\nx"}) {
    const std::string said = message(bytes, {.cell = cell, .layer = 1});
    EXPECT_THAT(said, HasSubstr("A\\nx, B\\nx, "));
    EXPECT_THAT(said, HasSubstr("J\\nx, ..."));
    EXPECT_EQ(said.find('\n'), std::string::npos);
  }
}

TEST_F(Gds, NotesOfAnEditorAreNoCell) {
  GdsWriter gds;
  gds.cell("TOP", [&] { gds.rectangle(1, 0, 0, 4, 4); });
  gds.cell("$$$CONTEXT_INFO$$$", [&] { gds.rectangle(1, 0, 0, 9, 9); });
  EXPECT_EQ(read(gds.finish(), {.layer = 1}).size(), 1U);
}

TEST_F(Gds, CompressedFilesAreRead) {
  GdsWriter gds;
  gds.cell("TOP", [&] { gds.rectangle(1, 0, 0, 4, 4); });
  // A gzip member around the bytes as they are.
  const std::string bytes = gds.finish();
  std::string packed("\x1f\x8b\x08\0\0\0\0\0\0\xff", 10);
  const auto little = [&](std::uint32_t value, int count) {
    for (int n = 0; n < count; ++n) packed += static_cast<char>(value >> (8 * n) & 0xff);
  };
  packed += '\x01';
  little(static_cast<std::uint32_t>(bytes.size()), 2);
  little(~static_cast<std::uint32_t>(bytes.size()), 2);
  packed += bytes;
  std::uint32_t crc = 0xffffffffU;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
  }
  little(~crc, 4);
  little(static_cast<std::uint32_t>(bytes.size()), 4);
  EXPECT_EQ(read(packed, {.layer = 1}).size(), 1U);
  EXPECT_THAT(message(packed.substr(0, packed.size() - 12), {.layer = 1}),
              HasSubstr("compressed data ends early"));
  packed[30] = static_cast<char>(packed[30] + 1);
  EXPECT_THAT(message(packed, {.layer = 1}), HasSubstr("compressed data is damaged"));
}

TEST_F(Gds, OasisIsRefusedByName) {
  EXPECT_THAT(
      message("%SEMI-OASIS\r\n", {.layer = 1}),
      HasSubstr("is an OASIS file; convert it to GDSII, for example with strm2gds of KLayout"));
}

TEST_F(Gds, AUnionIsThatOfEachShapeByItself) {
  // Bow ties, of which one lobe goes the other way, over a rectangle and over each other.
  const std::vector<int> tie{-500, -200, 500, 200, 500, -200, -500, 200, -500, -200};
  const std::vector<int> turned{-500, -200, -500, 200, 500, -200, 500, 200, -500, -200};
  const double of_tie = 2 * 0.5 * 500 * 400;
  const auto area_with = [&](const std::function<void(GdsWriter&)>& draw) {
    GdsWriter gds;
    gds.cell("TOP", [&] { draw(gds); });
    return area_of(read(gds.finish(), {.layer = 1}));
  };
  EXPECT_NEAR(area_with([&](GdsWriter& gds) { gds.boundary(1, 0, tie); }), of_tie, 1);
  EXPECT_NEAR(area_with([&](GdsWriter& gds) {
                gds.boundary(1, 0, tie);
                gds.boundary(1, 0, turned);
              }),
              of_tie, 1);
  EXPECT_NEAR(area_with([&](GdsWriter& gds) {
                gds.boundary(1, 0, tie);
                gds.rectangle(1, -600, -250, 600, 250);
              }),
              1200 * 500, 1);
  // Twice around is inside; a keyhole is a hole.
  EXPECT_NEAR(
      area_with([](GdsWriter& gds) {
        gds.boundary(1, 0, {0, 0, 100, 0, 100, 100, 0, 100, 0, 0, 100, 0, 100, 100, 0, 100});
      }),
      1e4, 1);
  EXPECT_NEAR(area_with([](GdsWriter& gds) {
                gds.boundary(1, 0, {0,  0,  100, 0,  100, 100, 0,  100, 0,  0,
                                    25, 25, 25,  75, 75,  75,  75, 25,  25, 25});
              }),
              1e4 - 2500, 1);
}

TEST_F(Gds, PointsBeyondAMetreAreRefused) {
  GdsWriter gds;
  gds.cell("DOT", [&] { gds.rectangle(1, 0, 0, 4, 4); });
  gds.cell("TOP", [&] { gds.reference("DOT", {0, 0}, {.magnification = 1e60}); });
  EXPECT_THAT(message(gds.finish(), {.layer = 1}), HasSubstr("more than 1 m away"));
}

}  // namespace
}  // namespace scarp
