#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/tri_mesh.h"
#include "mesh/files/mesh_file.h"

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

  /// What the file holds besides the surface, as read_mesh_file() says it.
  std::vector<std::string> left_out;
  std::vector<std::string> data_left_out;

  /// Adds a polygon of at least three corners, and its triangles. Negative or huge indices are kept
  /// as out of range.
  void add_polygon(const std::vector<std::int64_t>& polygon);
  /// Adds the triangles of a strip, every second one turned over; those that only join parts of it
  /// have two equal corners and do not count.
  void add_strip(std::span<const std::int64_t> strip);
};

/// "3 lines", "1 line".
std::string counted(std::uint64_t count, const std::string& thing);

/// Text without the mark of its encoding in front.
///
/// Throws: InputError if it is UTF-16.
MeshText without_mark(const MeshText& text);

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
  enum class Lines {
    single,
    joined  ///< a `\` at the end of a line joins the next one to it
  };
  explicit WordReader(const MeshText& text, Lines lines = Lines::single)
      : text_(text), lines_(lines) {}

  /// Steps to the next line; false at the end.
  bool next_line();
  /// The next word of this line and of those joined to it; empty at its end.
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
  std::string_view word_of_line();

  const MeshText& text_;
  Lines lines_;
  std::string_view rest_;
  std::size_t next_ = 0;
  std::size_t line_ = 0;
};

}  // namespace scarp
