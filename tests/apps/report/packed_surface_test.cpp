#include "apps/report/packed_surface.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/random.h"

namespace scarp {
namespace {

/// The bytes of a surface one after the other, read as packed_surface.h says.
class Unpacker {
 public:
  explicit Unpacker(const PackedSurface& packed) : packed_(packed) {
    uLongf size = 6 * packed.vertex_count + 15 * packed.facet_count +
                  packed.fields.size() * packed.facet_count;
    bytes_.resize(size);
    EXPECT_EQ(uncompress(bytes_.data(), &size, reinterpret_cast<const Bytef*>(packed.bytes.data()),
                         packed.bytes.size()),
              Z_OK);
    bytes_.resize(size);
    next_ = 6 * packed.vertex_count;
  }

  double coordinate(std::size_t vertex, std::size_t axis) const {
    std::uint16_t place = 0;
    const std::size_t begin = 2 * axis * packed_.vertex_count;
    for (std::size_t v = 0; v <= vertex; ++v) {
      const auto step = static_cast<std::uint32_t>(bytes_[begin + v] << 8 |
                                                   bytes_[begin + packed_.vertex_count + v]);
      place = static_cast<std::uint16_t>(place + unfolded(step));
    }
    const double lower = packed_.lower.at(axis);
    return lower + (packed_.upper.at(axis) - lower) * place / 65535.0;
  }

  std::vector<Triangle> triangles() {
    std::vector<Triangle> found;
    std::int64_t first = 0;
    for (std::size_t f = 0; f < packed_.facet_count; ++f) {
      const std::int64_t a = first + unfolded(varint());
      const std::int64_t b = a + unfolded(varint());
      const std::int64_t c = b + unfolded(varint());
      first = a;
      found.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b),
                       static_cast<std::uint32_t>(c)});
    }
    return found;
  }

  /// Codes of a field; after triangles().
  std::vector<int> codes(std::size_t field) const {
    const auto begin =
        bytes_.begin() + static_cast<std::ptrdiff_t>(next_ + field * packed_.facet_count);
    return {begin, begin + static_cast<std::ptrdiff_t>(packed_.facet_count)};
  }

  std::size_t size() const { return bytes_.size(); }
  std::size_t next() const { return next_; }

 private:
  static std::int32_t unfolded(std::uint32_t n) {
    return static_cast<std::int32_t>(n >> 1) ^ -static_cast<std::int32_t>(n & 1);
  }

  std::uint32_t varint() {
    std::uint32_t value = 0;
    for (int shift = 0;; shift += 7) {
      const std::uint32_t byte = bytes_.at(next_++);
      value |= (byte & 0x7f) << shift;
      if (byte < 0x80) return value;
    }
  }

  const PackedSurface& packed_;
  std::vector<unsigned char> bytes_;
  std::size_t next_ = 0;
};

double value_of(int code, const PackedField& field) {
  return field.low + code * (field.high - field.low) / 254;
}

/// Triangles that jump to and fro between vertices anywhere in a flat box.
TriMesh scattered_mesh(std::uint32_t vertices, std::uint32_t facets) {
  TriMesh mesh;
  const auto xi = [](std::uint32_t n, std::uint32_t k) {
    return 0.5F +
           0.5F * std::sin(12.9898F * static_cast<float>(n) + 78.233F * static_cast<float>(k));
  };
  for (std::uint32_t v = 0; v < vertices; ++v)
    mesh.vertices.push_back({-400 + 900 * xi(v, 0), 30 * xi(v, 1), -7000 * xi(v, 2)});
  for (std::uint32_t f = 0; f < facets; ++f)
    mesh.triangles.push_back(
        {f * 7919 % vertices, (f * 104729 + 1) % vertices, (f * 31 + 2) % vertices});
  return mesh;
}

TEST(PackedSurface, ComesBackWithinItsError) {
  const TriMesh mesh = scattered_mesh(3000, 5000);
  const PackedSurface packed = pack(mesh, {});
  EXPECT_NEAR(packed.error(), 0.5 * 7000 / 65535, 1e-3);
  Unpacker unpacker(packed);
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 37) {
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(unpacker.coordinate(v, static_cast<std::size_t>(axis)),
                  static_cast<double>(mesh.vertices[v][axis]), 1.001 * packed.error())
          << "vertex " << v;
  }
  EXPECT_EQ(unpacker.triangles(), mesh.triangles);
  EXPECT_EQ(unpacker.next(), unpacker.size());
}

TEST(PackedSurface, FieldsComeBackWithinHalfAStep) {
  const TriMesh mesh = scattered_mesh(100, 1000);
  FacetArray flux{.name = "flux", .values = {}};
  for (int f = 0; f < 1000; ++f) flux.values.push_back(0.001F * static_cast<float>(f));
  const PackedSurface packed = pack(mesh, {flux, flux});
  // Half a per cent is left out on either side.
  EXPECT_FLOAT_EQ(packed.fields[0].low, 0.005F);
  EXPECT_FLOAT_EQ(packed.fields[0].high, 0.994F);
  Unpacker unpacker(packed);
  unpacker.triangles();
  const std::vector<int> codes = unpacker.codes(1);
  const double step = (packed.fields[1].high - packed.fields[1].low) / 254;
  for (std::size_t f = 5; f < 995; ++f)
    EXPECT_NEAR(value_of(codes[f], packed.fields[1]), static_cast<double>(flux.values[f]),
                0.501 * step);
  EXPECT_EQ(codes[0], 0);
  EXPECT_EQ(codes[999], 254);
}

TEST(PackedSurface, WhatIsNoNumberIsNone) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const TriMesh mesh = scattered_mesh(10, 4);
  const PackedSurface packed = pack(mesh, {{.name = "flux", .values = {nan, 1, 3, nan}},
                                           {.name = "none", .values = {nan, nan, nan, nan}}});
  Unpacker unpacker(packed);
  unpacker.triangles();
  EXPECT_EQ(unpacker.codes(0), (std::vector{255, 0, 254, 255}));
  EXPECT_EQ(unpacker.codes(1), (std::vector{255, 255, 255, 255}));
}

TEST(PackedSurface, NumbersOfMaterialsAreExact) {
  const TriMesh mesh = scattered_mesh(10, 4);
  const PackedSurface packed = pack(mesh, {{.name = material_field, .values = {2, 0, 31, 254}}});
  Unpacker unpacker(packed);
  unpacker.triangles();
  EXPECT_EQ(unpacker.codes(0), (std::vector{2, 0, 31, 254}));
  EXPECT_EQ(value_of(31, packed.fields[0]), 31);
}

// A wafer that nothing has happened to has no height.
TEST(PackedSurface, AFlatSurfaceStaysFlat) {
  const TriMesh mesh{
      .vertices = {{0, 0, 5}, {1, 0, 5}, {0, 1, 5}}, .triangles = {{0, 1, 2}}, .materials = {}};
  const PackedSurface packed = pack(mesh, {});
  const Unpacker unpacker(packed);
  for (std::size_t v = 0; v < 3; ++v) EXPECT_EQ(unpacker.coordinate(v, 2), 5);
}

TEST(PackedSurface, NeedsATriangle) { EXPECT_THROW(pack({}, {}), NumericalError); }

}  // namespace
}  // namespace scarp
