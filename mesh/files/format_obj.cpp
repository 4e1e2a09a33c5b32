// Wavefront OBJ: only `v` and `f` matter for a surface.

#include <algorithm>
#include <array>
#include <charconv>
#include <map>

#include "core/error.h"
#include "mesh/files/mesh_format.h"

namespace scarp {

namespace {

/// The vertex of a corner "v", "v/t", "v//n" or "v/t/n". Counts from 1; negative: from the last.
std::int64_t corner(const WordReader& reader, std::string_view word, std::size_t vertex_count) {
  const std::int64_t index = reader.integer(word.substr(0, word.find('/')));
  if (index == 0) reader.fail("corner 0 of a face; vertices count from 1");
  return index > 0 ? index - 1 : static_cast<std::int64_t>(vertex_count) + index;
}

/// How faces look, are grouped and are drawn: none of it moves them.
constexpr std::array<std::string_view, 14> no_shape{
    "o",      "g",     "s",   "mg",    "usemtl",     "mtllib",    "usemap",
    "maplib", "bevel", "lod", "ctech", "shadow_obj", "trace_obj", "stech"};

/// Of curves and free-form surfaces.
constexpr std::array<std::string_view, 15> free_form{"cstype", "deg",  "bmat", "step", "curv",
                                                     "curv2",  "surf", "parm", "trim", "hole",
                                                     "scrv",   "sp",   "end",  "con",  "vp"};

template <std::size_t N>
bool is_among(const std::array<std::string_view, N>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

class ObjReader {
 public:
  explicit ObjReader(const MeshText& text)
      : text_(text), reader_(text, WordReader::Lines::joined) {}

  RawMesh read() {
    while (reader_.next_line()) read_line(reader_.word());
    // Only now, because a face may stand before its vertices.
    if (highest_ >= static_cast<std::int64_t>(mesh_.vertices.size())) {
      throw InputError(text_.name + ":" + std::to_string(highest_line_) + ": corner " +
                       std::to_string(highest_ + 1) + " is not among the " +
                       std::to_string(mesh_.vertices.size()) +
                       " vertices of the file (does the file end early?)");
    }
    note_rest();
    return std::move(mesh_);
  }

 private:
  void read_line(std::string_view keyword) {
    if (keyword.empty() || keyword.front() == '#' || is_among(no_shape, keyword)) return;
    if (keyword == "v") return read_vertex();
    if (keyword == "f" || keyword == "fo") return read_face();
    if (is_among(free_form, keyword)) {
      reader_.fail(in_quotes(keyword) +
                   " belongs to curves and free-form surfaces, which are not read; write the "
                   "surface as polygons");
    }
    if (keyword == "call" || keyword == "csh") {
      reader_.fail(in_quotes(keyword) +
                   " calls other files or programs, which is not done; write "
                   "all into one file");
    }
    // What goes on over several lines is to be left out whole.
    const std::string name(keyword);
    while (!reader_.word().empty()) {
    }
    ++others_[name];
  }

  void read_vertex() {
    const float x = reader_.coordinate(reader_.word());
    const float y = reader_.coordinate(reader_.word());
    const float z = reader_.coordinate(reader_.word());
    mesh_.vertices.push_back({x, y, z});
    const std::string_view more = reader_.word();
    if (!more.empty() && more.front() != '#') has_vertex_data_ = true;
  }

  void read_face() {
    polygon_.clear();
    for (std::string_view word = reader_.word(); !word.empty() && word.front() != '#';
         word = reader_.word()) {
      polygon_.push_back(corner(reader_, word, mesh_.vertices.size()));
      if (polygon_.back() < 0) reader_.fail("a corner counts back beyond the first vertex");
      if (polygon_.back() > highest_) {
        highest_ = polygon_.back();
        highest_line_ = reader_.line();
      }
    }
    if (polygon_.size() < 3) reader_.fail("a face needs three corners (does the file end early?)");
    mesh_.add_polygon(polygon_);
  }

  void note_rest() {
    if (has_vertex_data_) mesh_.data_left_out.emplace_back("colours or weights of vertices");
    for (const auto& [keyword, count] : others_) {
      if (keyword == "p") {
        mesh_.left_out.push_back(counted(count, "element") + " of points");
      } else if (keyword == "l") {
        mesh_.left_out.push_back(counted(count, "line"));
      } else if (keyword == "vn") {
        mesh_.data_left_out.push_back(counted(count, "normal"));
      } else if (keyword == "vt") {
        mesh_.data_left_out.push_back(counted(count, "texture coordinate"));
      } else {
        mesh_.left_out.push_back(counted(count, "row") + " of " + in_quotes(keyword));
      }
    }
  }

  const MeshText& text_;
  WordReader reader_;
  RawMesh mesh_;
  std::vector<std::int64_t> polygon_;
  std::int64_t highest_ = -1;
  std::size_t highest_line_ = 0;
  bool has_vertex_data_ = false;
  std::map<std::string, std::size_t> others_;  ///< by keyword, how often
};

void append_number(std::string& text, float value) {
  char digits[32];
  const auto result = std::to_chars(digits, digits + sizeof(digits), value);
  text.append(digits, result.ptr);
}

}  // namespace

RawMesh read_obj(const MeshText& text) {
  const MeshText unmarked = without_mark(text);
  return ObjReader(unmarked).read();
}

std::string obj_text(const TriMesh& mesh) {
  std::string text;
  text.reserve(40 * mesh.vertices.size() + 24 * mesh.triangles.size());
  for (const Vec3f& r : mesh.vertices) {
    text += "v ";
    append_number(text, r.x);
    text += ' ';
    append_number(text, r.y);
    text += ' ';
    append_number(text, r.z);
    text += '\n';
  }
  for (const Triangle& t : mesh.triangles) {
    text += 'f';
    for (const std::uint32_t v : t) text += ' ' + std::to_string(v + 1);
    text += '\n';
  }
  return text;
}

}  // namespace scarp
