#include "mesh/files/mesh_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <system_error>

#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/system/atomic_file.h"
#include "core/system/read_file.h"
#include "core/triangulate.h"
#include "mesh/files/mesh_format.h"

namespace scarp {

namespace {

constexpr std::uint32_t no_vertex = std::numeric_limits<std::uint32_t>::max();

std::string ending_of(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  for (char& c : ending) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return ending;
}

[[noreturn]] void fail_unknown_ending(const std::filesystem::path& file, const char* known) {
  throw InputError(shown(file) + ": the ending does not name a mesh format; use " + known);
}

using MeshReader = RawMesh (*)(const MeshText&);

MeshReader reader_for(const std::filesystem::path& file) {
  const std::string ending = ending_of(file);
  if (ending == ".obj") return read_obj;
  if (ending == ".ply") return read_ply;
  if (ending == ".stl") return read_stl;
  if (ending == ".vtp") return read_vtp;
  fail_unknown_ending(file, ".obj, .ply, .stl or .vtp");
}

/// Beyond, squares of squares leave the range of numbers.
constexpr float largest_coordinate = 1e15F;
constexpr float smallest_extent = 1e-15F;

constexpr double most_rounding = 0.01;  // of the size of facets

void check_vertices(const std::string& name, const RawMesh& mesh) {
  Box box;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3f r = mesh.vertices[v];
    const auto where = [&] {
      return name + ": vertex " + std::to_string(v) + " (counted from 0) ";
    };
    if (!std::isfinite(r.x) || !std::isfinite(r.y) || !std::isfinite(r.z)) {
      throw InputError(where() + "at " + rounded_place(Vec3d(r)) + " is not finite");
    }
    if (std::max({std::abs(r.x), std::abs(r.y), std::abs(r.z)}) > largest_coordinate) {
      throw InputError(where() +
                       "is too far away; no coordinate may be above 1e15: correct the "
                       "vertex or scale the mesh");
    }
    box.add(Vec3d(r));
  }
  const Vec3d size = box.upper - box.lower;
  const double extent = std::max({size.x, size.y, size.z});
  if (extent < smallest_extent)
    throw InputError(name + ": all of it lies within 1e-15; scale the mesh");
  // Coordinates have 24 bits.
  const double facet_size = extent / std::sqrt(static_cast<double>(mesh.triangles.size()));
  const double farthest =
      std::max({std::abs(box.lower.x), std::abs(box.lower.y), std::abs(box.lower.z),
                std::abs(box.upper.x), std::abs(box.upper.y), std::abs(box.upper.z)});
  if (0x1p-24 * farthest > most_rounding * facet_size) {
    throw InputError(name +
                     ": lies so far from the origin that 24 bits cannot hold its coordinates to a "
                     "hundredth of its facets; move it to the origin");
  }
}

// What looks for the nearest facet, or for the first one that a ray meets, has to look at all that
// meet in a point: the time would go by the square of their number.
constexpr std::uint32_t most_facets_at_vertex = 4096;

void check_stars(const std::string& name, const RawMesh& mesh) {
  std::vector<std::uint32_t> count(mesh.vertices.size());
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) ++count[v];
  const auto most = std::ranges::max_element(count);
  if (*most <= most_facets_at_vertex) return;
  throw InputError(name + ": " + std::to_string(*most) + " facets meet at vertex " +
                   std::to_string(most - count.begin()) + " (counted from 0), where at most " +
                   std::to_string(most_facets_at_vertex) +
                   " may; cut them so that fewer share a corner");
}

// Not a fan, whose thin triangles would all meet in one corner. Quadrilaterals are cut as one.
void cut_in_halves(std::span<const std::uint32_t> corners, std::vector<Triangle>& triangles) {
  if (corners.size() < 3) return;
  const std::size_t middle = corners.size() / 2;
  cut_in_halves(corners.first(middle + 1), triangles);
  triangles.push_back({corners.front(), corners[middle], corners.back()});
  cut_in_halves(corners.subspan(middle), triangles);
}

Vec3d area_of(const Triangle& triangle, const std::vector<Vec3f>& vertices) {
  const Vec3d a(vertices[triangle[0]]);
  return 0.5 * cross(Vec3d(vertices[triangle[1]]) - a, Vec3d(vertices[triangle[2]]) - a);
}

Vec3d sum_of_areas(std::span<const Triangle> triangles, const std::vector<Vec3f>& vertices) {
  Vec3d sum;
  for (const Triangle& triangle : triangles) sum += area_of(triangle, vertices);
  return sum;
}

// As seen along the axis to which it is nearest to upright, so that it runs counter-clockwise.
std::vector<std::array<double, 2>> seen_flat(std::span<const std::uint32_t> corners, Vec3d area,
                                             const std::vector<Vec3f>& vertices) {
  const Vec3d size{std::abs(area.x), std::abs(area.y), std::abs(area.z)};
  const int axis = size.z >= size.x && size.z >= size.y ? 2 : size.x >= size.y ? 0 : 1;
  int x = (axis + 1) % 3;
  int y = (axis + 2) % 3;
  if (area[axis] < 0) std::swap(x, y);
  std::vector<std::array<double, 2>> points;
  for (const std::uint32_t corner : corners) {
    const Vec3d r(vertices[corner]);
    points.push_back({r[x], r[y]});
  }
  return points;
}

// Whether no triangle faces the other way than all together, but for rounding.
bool lie_side_by_side(std::span<const Triangle> triangles, Vec3d area,
                      const std::vector<Vec3f>& vertices) {
  constexpr double rounding = 1e-6;
  return std::ranges::all_of(triangles, [&](const Triangle& triangle) {
    const Vec3d own = area_of(triangle, vertices);
    return dot(own, area) >= -rounding * dot(area, area) && length(own) * rounding <= length(area);
  });
}

// Halves of a polygon that is not convex may lie outside of it and on each other: it is cut by its
// ears.
void cut_again(const std::string& name, std::span<const std::uint32_t> corners, Vec3d area,
               const std::vector<Vec3f>& vertices, std::span<Triangle> triangles) {
  constexpr std::size_t most_corners = 4096;  // the time goes by their square
  const auto refuse = [&](const std::string& what) {
    throw InputError(name + ": the polygon of " + std::to_string(corners.size()) +
                     " corners that begins at vertex " + std::to_string(corners.front()) +
                     " (counted from 0) " + what + "; cut it into triangles");
  };
  if (corners.size() > most_corners) {
    refuse("is not convex, and may have at most " + std::to_string(most_corners) +
           " corners therefore");
  }
  VertexLoop loop(corners.size());
  std::iota(loop.begin(), loop.end(), 0U);
  const std::vector<Triangle> cut = triangulate(seen_flat(corners, area, vertices), {loop});
  SCARP_ASSERT(cut.size(), ==, triangles.size());
  for (std::size_t t = 0; t < cut.size(); ++t) {
    const auto [a, b, c] = cut[t];
    triangles[t] = {corners[a], corners[b], corners[c]};
  }
  if (!lie_side_by_side(triangles, area, vertices)) refuse("crosses itself");
}

void cut_polygons_that_are_not_convex(const std::string& name, RawMesh& mesh) {
  for (const auto& [first, corners] : mesh.polygons) {
    const std::span<Triangle> triangles =
        std::span(mesh.triangles).subspan(first, corners.size() - 2);
    const Vec3d area = sum_of_areas(triangles, mesh.vertices);
    if (!lie_side_by_side(triangles, area, mesh.vertices))
      cut_again(name, corners, area, mesh.vertices, triangles);
  }
}

std::uint32_t index(std::int64_t i) {
  return i < 0 || i >= no_vertex ? no_vertex : static_cast<std::uint32_t>(i);
}

void check_indices(const std::string& name, const RawMesh& mesh) {
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    for (const std::uint32_t v : mesh.triangles[f]) {
      if (v >= mesh.vertices.size()) {
        throw InputError(name + ": triangle " + std::to_string(f) +
                         " (counted from 0) has a corner that is not among the " +
                         std::to_string(mesh.vertices.size()) + " vertices");
      }
    }
  }
}

void check(const std::string& name, const RawMesh& mesh) {
  if (mesh.vertices.empty()) throw InputError(name + ": has no vertices");
  if (mesh.triangles.empty()) throw InputError(name + ": has no triangles; a surface is needed");
  check_vertices(name, mesh);
  check_indices(name, mesh);
}

}  // namespace

void RawMesh::add_polygon(const std::vector<std::int64_t>& polygon) {
  std::vector<std::uint32_t> corners;
  for (const std::int64_t corner : polygon) corners.push_back(index(corner));
  if (corners.size() == 3) {
    triangles.push_back({corners[0], corners[1], corners[2]});
    return;
  }
  const std::size_t first = triangles.size();
  cut_in_halves(corners, triangles);
  polygons.push_back({first, std::move(corners)});
}

void RawMesh::add_strip(std::span<const std::int64_t> strip) {
  for (std::size_t i = 0; i + 2 < strip.size(); ++i) {
    Triangle t{index(strip[i]), index(strip[i + 1]), index(strip[i + 2])};
    if (i % 2 == 1) std::swap(t[0], t[1]);
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
  }
}

MeshText without_mark(const MeshText& text) {
  constexpr std::string_view utf8 = "\xEF\xBB\xBF";
  const std::string_view start = text.content.substr(0, 2);
  if (start == "\xFF\xFE" || start == "\xFE\xFF") {
    throw InputError(text.name + ": is UTF-16 text; save it as UTF-8");
  }
  if (text.content.substr(0, utf8.size()) != utf8) return text;
  return {text.name, text.content.substr(utf8.size())};
}

std::string counted(std::uint64_t count, const std::string& thing) {
  return std::to_string(count) + ' ' + thing + (count == 1 ? "" : "s");
}

std::string number_text(double value) {
  std::array<char, 32> digits;
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

bool WordReader::next_line() {
  if (next_ >= text_.content.size()) return false;
  const std::size_t end = std::min(text_.content.find('\n', next_), text_.content.size());
  rest_ = text_.content.substr(next_, end - next_);
  next_ = end + 1;
  ++line_;
  return true;
}

std::string_view WordReader::word() {
  std::string_view found = word_of_line();
  if (lines_ == Lines::single) return found;
  // The word before the `\` ends there, unless the next line goes on with it at once.
  while (!found.empty() && found.back() == '\\' && rest_.find_first_not_of(" \t\r") == rest_.npos) {
    found.remove_suffix(1);
    if (!next_line()) return found;
    if (found.empty()) {
      found = word_of_line();
    } else if (!rest_.empty() && rest_.find_first_of(" \t\r") != 0) {
      fail("goes on within a word of the line before; put a space in front of the \"\\\"");
    } else {
      return found;
    }
  }
  return found;
}

std::string_view WordReader::word_of_line() {
  const std::size_t begin = rest_.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) {
    rest_ = {};
    return {};
  }
  const std::size_t end = std::min(rest_.find_first_of(" \t\r", begin), rest_.size());
  const std::string_view found = rest_.substr(begin, end - begin);
  rest_ = rest_.substr(end);
  return found;
}

std::string_view WordReader::word_across_lines() {
  std::string_view found = word();
  while (found.empty() && next_line()) found = word();
  return found;
}

double WordReader::number(std::string_view word) const {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) {
    fail(word.empty() ? "a number is missing (does the file end early?)"
                      : in_quotes(word) + " is not a number");
  }
  return value;
}

std::int64_t WordReader::integer(std::string_view word) const {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) {
    fail(word.empty() ? "an integer is missing (does the file end early?)"
                      : in_quotes(word) + " is not an integer");
  }
  return value;
}

float WordReader::coordinate(std::string_view word) const {
  const auto value = static_cast<float>(number(word));
  if (!std::isfinite(value)) fail("coordinate " + std::string(word) + " is not a finite number");
  return value;
}

void WordReader::fail(const std::string& message) const {
  throw InputError(text_.name + ":" + std::to_string(line_) + ": " + message);
}

MeshFile read_mesh_file(const std::filesystem::path& file) {
  reader_for(file);  // a file of another kind is not read
  return read_mesh_file(file, read_file(file));
}

TriMesh read_mesh(const std::filesystem::path& file) { return read_mesh_file(file).mesh; }

MeshFile read_mesh_file(const std::filesystem::path& file, std::string_view content) {
  const auto read = reader_for(file);
  if (content.empty()) throw InputError(shown(file) + ": the file is empty");
  RawMesh mesh = read({shown(file), content});
  check(shown(file), mesh);
  cut_polygons_that_are_not_convex(shown(file), mesh);
  check_stars(shown(file), mesh);
  return {.mesh = {std::move(mesh.vertices), std::move(mesh.triangles), std::move(mesh.materials)},
          .left_out = std::move(mesh.left_out),
          .data_left_out = std::move(mesh.data_left_out)};
}

std::string left_out_text(std::span<const std::string> things) {
  std::string text;
  for (const std::string& thing : things) text += (text.empty() ? "leaves out " : ", ") + thing;
  return text;
}

void write_mesh(const std::filesystem::path& file, const TriMesh& mesh) {
  const std::string ending = ending_of(file);
  if (ending == ".obj") return write_file(file, obj_text(mesh));
  if (ending == ".ply") return write_file(file, ply_bytes(mesh));
  if (ending == ".stl") return write_file(file, stl_bytes(mesh));
  if (ending == ".vtp") return write_file(file, vtp_bytes(mesh, {}));
  if (ending == ".vtu") return write_file(file, vtu_bytes(mesh));
  fail_unknown_ending(file, ".obj, .ply, .stl, .vtp or .vtu");
}

void write_vtp(const std::filesystem::path& file, const TriMesh& mesh, const MeshFields& fields) {
  if (ending_of(file) != ".vtp") {
    throw InputError(shown(file) + ": only a file whose name ends in .vtp can carry arrays");
  }
  write_file(file, vtp_bytes(mesh, fields));
}

}  // namespace scarp
