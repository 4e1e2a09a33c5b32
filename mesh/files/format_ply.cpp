// Stanford PLY, text or binary of either byte order.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "core/error.h"
#include "mesh/files/mesh_format.h"

namespace scarp {

namespace {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct ScalarName {
  std::string_view name;
  Scalar scalar;
};
constexpr std::array<ScalarName, 16> scalar_names{{{"char", Scalar::int8},
                                                   {"int8", Scalar::int8},
                                                   {"uchar", Scalar::uint8},
                                                   {"uint8", Scalar::uint8},
                                                   {"short", Scalar::int16},
                                                   {"int16", Scalar::int16},
                                                   {"ushort", Scalar::uint16},
                                                   {"uint16", Scalar::uint16},
                                                   {"int", Scalar::int32},
                                                   {"int32", Scalar::int32},
                                                   {"uint", Scalar::uint32},
                                                   {"uint32", Scalar::uint32},
                                                   {"float", Scalar::float32},
                                                   {"float32", Scalar::float32},
                                                   {"double", Scalar::float64},
                                                   {"float64", Scalar::float64}}};

constexpr double largest_integer = 0x1p32;

enum class Encoding { text, little_endian, big_endian };

struct Property {
  std::string name;
  Scalar scalar{};
  std::optional<Scalar> list_count;  ///< the type of a list's length
};

struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::text;
  std::vector<Element> elements;
};

Scalar scalar_of(const WordReader& reader, std::string_view word) {
  for (const ScalarName& entry : scalar_names) {
    if (entry.name == word) return entry.scalar;
  }
  reader.fail(in_quotes(word) + " is not a type of PLY");
}

Encoding encoding_of(const WordReader& reader, std::string_view word) {
  if (word == "ascii") return Encoding::text;
  if (word == "binary_little_endian") return Encoding::little_endian;
  if (word == "binary_big_endian") return Encoding::big_endian;
  reader.fail(in_quotes(word) +
              " is not a format of PLY (ascii, binary_little_endian, binary_big_endian)");
}

Property read_property(WordReader& reader) {
  Property property;
  std::string_view type = reader.word();
  if (type == "list") {
    property.list_count = scalar_of(reader, reader.word());
    type = reader.word();
  }
  property.scalar = scalar_of(reader, type);
  property.name = reader.word();
  return property;
}

Header read_header(WordReader& reader) {
  Header header;
  if (!reader.next_line() || reader.word() != "ply") reader.fail("the first line is not \"ply\"");
  while (reader.next_line()) {
    const std::string_view keyword = reader.word();
    if (keyword == "end_header") return header;
    if (keyword == "format") {
      header.encoding = encoding_of(reader, reader.word());
    } else if (keyword == "element") {
      Element element;
      element.name = reader.word();
      element.count = reader.integer(reader.word());
      if (element.count < 0) reader.fail("an element has a negative count");
      header.elements.push_back(element);
    } else if (keyword == "property") {
      if (header.elements.empty()) reader.fail("a property before any element");
      header.elements.back().properties.push_back(read_property(reader));
    }
  }
  reader.fail("the header has no end_header");
}

/// Gives the values of the body one after another, whatever the encoding.
class Body {
 public:
  Body(const MeshText& text, WordReader& reader, Encoding encoding)
      : text_(text), reader_(reader), encoding_(encoding), position_(reader.position()) {}

  /// Which element is being read, for messages.
  void at(const Element& element, std::int64_t index) {
    element_ = &element;
    index_ = index;
  }

  double value(Scalar scalar) {
    if (encoding_ == Encoding::text) {
      const std::string_view word = reader_.word_across_lines();
      if (word.empty()) fail("the file ends");
      return reader_.number(word);
    }
    switch (scalar) {
      case Scalar::int8:
        return take<std::int8_t>();
      case Scalar::uint8:
        return take<std::uint8_t>();
      case Scalar::int16:
        return take<std::int16_t>();
      case Scalar::uint16:
        return take<std::uint16_t>();
      case Scalar::int32:
        return take<std::int32_t>();
      case Scalar::uint32:
        return take<std::uint32_t>();
      case Scalar::float32:
        return take<float>();
      case Scalar::float64:
        return take<double>();
    }
    return 0;
  }

  /// A value that counts or names something; negative ones are -1.
  std::int64_t integer(Scalar scalar, const char* meaning) {
    const double number = value(scalar);
    if (!(number == std::trunc(number)) || number > largest_integer) {
      fail(std::string(meaning) + " is " + number_text(number) +
           "; a whole number up to 2^32 is wanted");
    }
    return number < 0 ? -1 : static_cast<std::int64_t>(number);
  }

  /// Behind the last element, but for white space in text.
  std::size_t bytes_left() {
    if (encoding_ != Encoding::text) return text_.content.size() - position_;
    const std::string_view word = reader_.word_across_lines();
    return word.empty() ? 0
                        : text_.content.size() -
                              static_cast<std::size_t>(word.data() - text_.content.data());
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw InputError(text_.name + ": " + message + " at element " + element_->name + " " +
                     std::to_string(index_) + " of " + std::to_string(element_->count));
  }

 private:
  template <class T>
  T take() {
    std::array<char, sizeof(T)> bytes;
    if (position_ + sizeof(T) > text_.content.size()) fail("the file ends");
    std::memcpy(bytes.data(), text_.content.data() + position_, sizeof(T));
    position_ += sizeof(T);
    if (encoding_ == Encoding::big_endian) std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
  }

  const MeshText& text_;
  WordReader& reader_;
  Encoding encoding_;
  std::size_t position_;
  const Element* element_ = nullptr;
  std::int64_t index_ = 0;
};

bool names_corners(const Property& property) {
  return property.list_count &&
         (property.name == "vertex_indices" || property.name == "vertex_index");
}

/// Whether a property says where the surface is.
bool is_shape(const Element& element, const Property& property) {
  if (element.name == "vertex") {
    return !property.list_count &&
           (property.name == "x" || property.name == "y" || property.name == "z");
  }
  return names_corners(property);
}

/// What a list of corners stands for: parts of a strip end at negative numbers.
void add_corners(const Element& element, const std::vector<std::int64_t>& list, const Body& body,
                 RawMesh& mesh) {
  if (element.name == "face") {
    if (list.size() < 3) body.fail("a face has fewer than three corners");
    return mesh.add_polygon(list);
  }
  for (auto begin = list.begin(); begin != list.end();) {
    const auto end = std::find(begin, list.end(), -1);
    const auto size = static_cast<std::size_t>(end - begin);
    if (size > 0 && size < 3) body.fail("a strip has fewer than three corners");
    mesh.add_strip({list.data() + (begin - list.begin()), size});
    begin = end == list.end() ? end : end + 1;
  }
}

void read_element(const Element& element, Body& body, RawMesh& mesh) {
  const bool is_vertex = element.name == "vertex";
  const bool has_corners = element.name == "face" || element.name == "tristrips";
  if (element.properties.empty()) return;
  std::vector<std::int64_t> list;
  for (std::int64_t i = 0; i < element.count; ++i) {
    body.at(element, i);
    Vec3f r;
    for (const Property& property : element.properties) {
      if (!property.list_count) {
        const double value = body.value(property.scalar);
        if (property.name == "x") r.x = static_cast<float>(value);
        if (property.name == "y") r.y = static_cast<float>(value);
        if (property.name == "z") r.z = static_cast<float>(value);
        continue;
      }
      const std::int64_t count = body.integer(*property.list_count, "the length of a list");
      if (count < 0) body.fail("a list has a negative length");
      if (!has_corners || !names_corners(property)) {
        for (std::int64_t k = 0; k < count; ++k) body.value(property.scalar);
        continue;
      }
      list.clear();
      for (std::int64_t k = 0; k < count; ++k) {
        list.push_back(body.integer(property.scalar, "a corner"));
      }
      add_corners(element, list, body, mesh);
    }
    if (is_vertex) mesh.vertices.push_back(r);
  }
}

void note_what_is_left_out(const Header& header, RawMesh& mesh) {
  for (const Element& element : header.elements) {
    if (element.count == 0) continue;
    const bool is_read =
        element.name == "vertex" || element.name == "face" || element.name == "tristrips";
    if (!is_read) {
      mesh.left_out.push_back(counted(static_cast<std::uint64_t>(element.count), "element") + " " +
                              in_quotes(element.name));
      continue;
    }
    std::string names;
    for (const Property& property : element.properties) {
      if (is_shape(element, property)) continue;
      names += ' ' + in_quotes(property.name);
    }
    if (!names.empty()) mesh.data_left_out.push_back("data of " + element.name + names);
  }
}

void check_header(const MeshText& text, const Header& header) {
  bool has_vertices = false;
  for (const Element& element : header.elements) {
    if (element.name == "face" || element.name == "tristrips") {
      const bool there =
          std::any_of(element.properties.begin(), element.properties.end(), names_corners);
      if (!there && element.count > 0) {
        throw InputError(text.name + ": its element " + element.name +
                         " has no list vertex_indices or vertex_index");
      }
    }
    if (element.name != "vertex") continue;
    for (const char* axis : {"x", "y", "z"}) {
      const bool there =
          std::any_of(element.properties.begin(), element.properties.end(),
                      [axis](const Property& p) { return p.name == axis && !p.list_count; });
      if (!there) throw InputError(text.name + ": its vertices have no property " + axis);
    }
    has_vertices = true;
  }
  if (!has_vertices) throw InputError(text.name + ": its header names no vertices");
}

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

}  // namespace

RawMesh read_ply(const MeshText& marked) {
  const MeshText text = without_mark(marked);
  WordReader reader(text);
  const Header header = read_header(reader);
  check_header(text, header);
  RawMesh mesh;
  Body body(text, reader, header.encoding);
  for (const Element& element : header.elements) read_element(element, body, mesh);
  note_what_is_left_out(header, mesh);
  if (const std::size_t left = body.bytes_left(); left > 0) {
    mesh.left_out.push_back(counted(left, "byte") + " behind the elements that the file states");
  }
  return mesh;
}

std::string ply_bytes(const TriMesh& mesh) {
  static_assert(std::endian::native == std::endian::little);
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\ncomment written by scarp\nelement vertex " +
      std::to_string(mesh.vertices.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
      std::to_string(mesh.triangles.size()) +
      "\nproperty list uchar int vertex_indices\nend_header\n";
  bytes.reserve(bytes.size() + 12 * mesh.vertices.size() + 13 * mesh.triangles.size());
  for (const Vec3f& r : mesh.vertices) append(bytes, r);
  for (const Triangle& t : mesh.triangles) {
    append(bytes, std::uint8_t{3});
    append(bytes, t);
  }
  return bytes;
}

}  // namespace scarp
