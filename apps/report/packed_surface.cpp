#include "apps/report/packed_surface.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/system/deflate.h"

namespace scarp {

namespace {

constexpr double places_per_axis = 65535;
constexpr double colours = 254;
constexpr char no_number = '\xff';

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...
std::uint32_t folded(std::int32_t step) {
  return (static_cast<std::uint32_t>(step) << 1) ^ static_cast<std::uint32_t>(step >> 31);
}

void append_varint(std::string& bytes, std::uint32_t value) {
  for (; value >= 0x80; value >>= 7) bytes += static_cast<char>((value & 0x7f) | 0x80);
  bytes += static_cast<char>(value);
}

double coordinate(const Vec3f& r, int axis) { return static_cast<double>(r[axis]); }

void append_axis(std::string& bytes, const TriMesh& mesh, int axis, double lower, double upper) {
  const double scale = upper > lower ? places_per_axis / (upper - lower) : 0;
  std::string low_bytes;
  std::int32_t before = 0;
  for (const Vec3f& r : mesh.vertices) {
    // Vertices that no triangle uses may lie outside of the box.
    const double place = std::clamp((coordinate(r, axis) - lower) * scale, 0.0, places_per_axis);
    const auto now = static_cast<std::int32_t>(std::lround(place));
    const std::uint32_t step = folded(static_cast<std::int16_t>(now - before));
    before = now;
    bytes += static_cast<char>(step >> 8 & 0xff);
    low_bytes += static_cast<char>(step & 0xff);
  }
  bytes += low_bytes;
}

void append_triangles(std::string& bytes, std::span<const Triangle> triangles) {
  std::uint32_t first = 0;
  const auto step = [](std::uint32_t from, std::uint32_t to) {
    return folded(static_cast<std::int32_t>(to - from));
  };
  for (const auto& [a, b, c] : triangles) {
    append_varint(bytes, step(first, a));
    append_varint(bytes, step(a, b));
    append_varint(bytes, step(b, c));
    first = a;
  }
}

bool is_a_number(float value) { return std::isfinite(value); }

/// The range of 99 % of the numbers: half a per cent is left out on either side.
PackedField range_of(const FacetArray& field) {
  if (field.name == material_field) return {.name = field.name, .low = 0, .high = colours};
  std::vector<float> numbers;
  std::ranges::copy_if(field.values, std::back_inserter(numbers), is_a_number);
  if (numbers.empty()) return {.name = field.name};
  std::ranges::sort(numbers);
  const std::size_t out = numbers.size() / 200;
  return {.name = field.name,
          .low = static_cast<double>(numbers[out]),
          .high = static_cast<double>(numbers[numbers.size() - 1 - out])};
}

void append_field(std::string& bytes, const FacetArray& field, const PackedField& range) {
  const double scale = range.high > range.low ? colours / (range.high - range.low) : 0;
  for (const float value : field.values) {
    const double code = std::clamp((static_cast<double>(value) - range.low) * scale, 0.0, colours);
    bytes += is_a_number(value) ? static_cast<char>(std::lround(code)) : no_number;
  }
}

}  // namespace

double PackedSurface::error() const {
  double widest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    widest = std::max(widest, static_cast<double>(upper[axis]) - static_cast<double>(lower[axis]));
  return 0.5 * widest / places_per_axis;
}

PackedSurface pack(const TriMesh& mesh, const std::vector<FacetArray>& fields) {
  if (mesh.triangles.empty()) throw NumericalError("a surface without triangles cannot be packed");
  PackedSurface packed{.vertex_count = mesh.vertices.size(),
                       .facet_count = mesh.triangles.size(),
                       .fields = {},
                       .bytes = {}};
  const Box box = bounding_box(mesh);
  std::string bytes;
  for (int axis = 0; axis < 3; ++axis) {
    append_axis(bytes, mesh, axis, box.lower[axis], box.upper[axis]);
    packed.lower[static_cast<std::size_t>(axis)] = static_cast<float>(box.lower[axis]);
    packed.upper[static_cast<std::size_t>(axis)] = static_cast<float>(box.upper[axis]);
  }
  append_triangles(bytes, mesh.triangles);
  for (const FacetArray& field : fields) {
    SCARP_ASSERT(field.values.size(), ==, mesh.triangles.size());
    packed.fields.push_back(range_of(field));
    append_field(bytes, field, packed.fields.back());
  }
  packed.bytes = deflated(bytes);
  return packed;
}

}  // namespace scarp
