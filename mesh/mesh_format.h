#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/tri_mesh.h"
#include "mesh/mesh_file.h"

// The formats behind mesh_file.h. Readers take the whole content of a file and its name for
// messages; what every format has in common (ranges, finite values) is checked by read_mesh.

namespace scarp {

/// The content of a mesh file, being read.
struct MeshText {
  std::string name;
  std::string_view content;
};

/// A mesh as in a file, its ranges not yet checked.
struct RawMesh {
  std::vector<Vec3f> vertices;
  std::vector<Triangle> triangles;
  std::vector<MaterialId> materials;

  /// A polygon of more than three corners. Its triangles stand in a row, cut as if it were convex:
  /// what is not is only known with all vertices.
  struct Polygon {
    std::size_t first_triangle = 0;
    std::vector<std::uint32_t> corners;
  };
  std::vector<Polygon> polygons;

  /// Adds a polygon of at least three corners, and its triangles. Negative or huge indices are kept
  /// as out of range.
  void add_polygon(const std::vector<std::int64_t>& polygon);
};

/// The shortest text of a number, those that are not finite included.
std::string number_text(double value);

RawMesh read_obj(const MeshText& text);
RawMesh read_ply(const MeshText& text);
RawMesh read_stl(const MeshText& text);
RawMesh read_vtp(const MeshText& text);

std::string obj_text(const TriMesh& mesh);
std::string ply_bytes(const TriMesh& mesh);
std::string stl_bytes(const TriMesh& mesh);
std::string vtu_bytes(const TriMesh& mesh);
std::string vtp_bytes(const TriMesh& mesh, const MeshFields& fields);

/// Goes through text word by word and knows the line, for formats of text.
class WordReader {
 public:
  explicit WordReader(const MeshText& text) : text_(text) {}

  /// Steps to the next line; false at the end.
  bool next_line();
  /// The next word of this line; empty at its end.
  std::string_view word();
  /// The next word of this or a later line; empty at the end of the text.
  std::string_view word_across_lines();

  double number(std::string_view word) const;
  std::int64_t integer(std::string_view word) const;
  /// A coordinate: finite, and within the range of float.
  float coordinate(std::string_view word) const;

  std::size_t line() const { return line_; }
  /// Where the next line begins.
  std::size_t position() const { return next_; }
  [[noreturn]] void fail(const std::string& message) const;

 private:
  const MeshText& text_;
  std::string_view rest_;
  std::size_t next_ = 0;
  std::size_t line_ = 0;
};

}  // namespace scarp
