// VTK polydata in XML, and the .pvd list of them.
// Source: VTK file formats, "XML file formats" (docs.vtk.org).

#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <pugixml.hpp>
#include <utility>

#include "core/error.h"
#include "core/printable.h"
#include "core/system/atomic_file.h"
#include "core/system/deflate.h"
#include "core/system/read_file.h"
#include "mesh/files/mesh_format.h"

namespace scarp {

namespace {

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '&') {
      result += "&amp;";
    } else if (c == '<') {
      result += "&lt;";
    } else if (c == '>') {
      result += "&gt;";
    } else if (c == '"') {
      result += "&quot;";
    } else {
      result += c;
    }
  }
  return result;
}

// --- writing -----------------------------------------------------------------------------------

template <class T>
struct VtkType;
template <>
struct VtkType<float> {
  static constexpr const char* name = "Float32";
  static constexpr int components = 1;
};
template <>
struct VtkType<double> {
  static constexpr const char* name = "Float64";
  static constexpr int components = 1;
};
template <>
struct VtkType<std::int32_t> {
  static constexpr const char* name = "Int32";
  static constexpr int components = 1;
};
template <>
struct VtkType<std::uint16_t> {
  static constexpr const char* name = "UInt16";
  static constexpr int components = 1;
};
template <>
struct VtkType<std::uint8_t> {
  static constexpr const char* name = "UInt8";
  static constexpr int components = 1;
};
template <>
struct VtkType<Vec3f> {
  static constexpr const char* name = "Float32";
  static constexpr int components = 3;
};

/// The XML text and, behind it, the arrays: each its size in bytes and then its values.
struct VtpWriter {
  std::string xml;
  std::string appended;

  template <class T>
  void add(std::string_view name, std::span<const T> values) {
    xml += "        <DataArray type=\"" + std::string(VtkType<T>::name) + "\" Name=\"" +
           escaped(name) + "\" NumberOfComponents=\"" + std::to_string(VtkType<T>::components) +
           "\" format=\"appended\" offset=\"" + std::to_string(appended.size()) + "\"/>\n";
    const std::uint64_t size = values.size_bytes();
    appended.append(reinterpret_cast<const char*>(&size), sizeof(size));
    appended.append(reinterpret_cast<const char*>(values.data()), size);
  }

  void add_fields(const std::vector<FieldView>& fields, std::size_t count) {
    for (const FieldView& field : fields) {
      std::visit(
          [&](const auto& values) {
            SCARP_ASSERT(values.size(), ==, count);
            add(field.name, values);
          },
          field.values);
    }
  }
};

/// Texts as VTK has them: the codes of their bytes, with a zero behind each text.
std::string string_array(std::string_view name, std::span<const std::string> texts) {
  std::string codes;
  for (const std::string& text : texts) {
    for (const char c : text) codes += std::to_string(static_cast<unsigned char>(c)) + ' ';
    codes += "0\n";
  }
  return "      <DataArray type=\"String\" Name=\"" + escaped(name) + "\" NumberOfTuples=\"" +
         std::to_string(texts.size()) + "\" format=\"ascii\">\n" + codes + "      </DataArray>\n";
}

/// What belongs to the whole surface; nothing where there is nothing to say.
std::string field_data(const MeshFields& fields) {
  std::string arrays;
  if (!fields.material_names.empty()) {
    arrays += string_array("material_names", fields.material_names);
  }
  if (fields.time) {
    arrays +=
        "      <DataArray type=\"Float64\" Name=\"process_time_s\" NumberOfTuples=\"1\" "
        "format=\"ascii\">" +
        number_text(*fields.time) + "</DataArray>\n";
  }
  return arrays.empty() ? "" : "    <FieldData>\n" + arrays + "    </FieldData>\n";
}

void add_polygons(VtpWriter& writer, const TriMesh& mesh) {
  std::vector<std::int32_t> connectivity;
  std::vector<std::int32_t> offsets;
  connectivity.reserve(3 * mesh.triangles.size());
  offsets.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) connectivity.push_back(static_cast<std::int32_t>(v));
    offsets.push_back(static_cast<std::int32_t>(connectivity.size()));
  }
  writer.add("connectivity", std::span<const std::int32_t>(connectivity));
  writer.add("offsets", std::span<const std::int32_t>(offsets));
}

// --- reading -----------------------------------------------------------------------------------

/// A parsed file. Data that is appended raw is no XML, so it is cut off before parsing.
struct VtpFile {
  const std::string& name;
  pugi::xml_document xml;
  std::string_view appended;
  bool appended_is_base64 = false;
  bool is_compressed = false;
  std::size_t size_bytes = 4;  ///< of the numbers in front of each array

  [[noreturn]] void fail(const std::string& message) const {
    throw InputError(name + ": " + message);
  }
};

void parse_xml(VtpFile& file, std::string_view content) {
  std::string head(content);
  const std::size_t tag = content.find("<AppendedData");
  if (tag != std::string_view::npos) {
    const std::size_t begin = content.find('_', content.find('>', tag));
    if (begin == std::string_view::npos) file.fail("ends before its appended data");
    file.appended = content.substr(begin + 1);
    file.appended_is_base64 =
        content.substr(tag, begin - tag).find("base64") != std::string_view::npos;
    head = std::string(content.substr(0, tag)) + "</VTKFile>";
  }
  const pugi::xml_parse_result result = file.xml.load_buffer(head.data(), head.size());
  if (!result) {
    file.fail("is not a complete XML file: " + std::string(result.description()) + " at byte " +
              std::to_string(result.offset));
  }
  const pugi::xml_node root = file.xml.child("VTKFile");
  if (std::string_view(root.attribute("type").value()) != "PolyData") {
    file.fail("is not VTK polydata (VTKFile with type=\"PolyData\")");
  }
  if (std::string_view(root.attribute("byte_order").as_string("LittleEndian")) != "LittleEndian") {
    file.fail("is big-endian; write it with byte_order LittleEndian");
  }
  const std::string_view compressor = root.attribute("compressor").value();
  file.is_compressed = !compressor.empty();
  if (file.is_compressed && compressor != "vtkZLibDataCompressor") {
    file.fail("is compressed by " + in_quotes(compressor) +
              "; write it with the compressor ZLib or none (ParaView: Compressor Type)");
  }
  const std::string_view header = root.attribute("header_type").as_string("UInt32");
  if (header != "UInt32" && header != "UInt64") {
    file.fail("has the unknown header_type " + in_quotes(header));
  }
  if (header == "UInt64") file.size_bytes = 8;
}

std::string decode_base64(const VtpFile& file, std::string_view text) {
  const auto digit = [](char c) -> int {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
  };
  std::string bytes;
  std::uint32_t bits = 0;
  int bit_count = 0;
  for (const char c : text) {
    // The size may be encoded on its own: padding in the middle starts anew.
    if (c == '=') {
      bit_count = 0;
      continue;
    }
    if (std::isspace(static_cast<unsigned char>(c)) != 0) continue;
    const int value = digit(c);
    if (value < 0) break;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    bit_count += 6;
    if (bit_count >= 8) {
      bit_count -= 8;
      bytes += static_cast<char>(bits >> bit_count & 0xff);
    }
  }
  if (bytes.size() < file.size_bytes) file.fail("an array of base64 data ends early");
  return bytes;
}

/// Takes numbers and bytes off the front of an array.
class ArrayBytes {
 public:
  ArrayBytes(const VtpFile& file, std::string_view bytes, const char* array)
      : file_(file), bytes_(bytes), array_(array) {}

  std::uint64_t number() {
    const std::string_view front = take(file_.size_bytes);
    std::uint64_t value = 0;
    std::memcpy(&value, front.data(), front.size());
    return value;
  }
  std::string_view take(std::uint64_t size) {
    if (size > bytes_.size()) file_.fail(std::string("ends within the array ") + array_);
    const std::string_view front = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return front;
  }
  std::size_t left() const { return bytes_.size(); }
  [[noreturn]] void fail_damaged() const {
    file_.fail(std::string("has compressed data in the array ") + array_ + " that are damaged");
  }

 private:
  const VtpFile& file_;
  std::string_view bytes_;
  const char* array_;
};

/// Source: VTK file formats: the number of blocks, the size of each before compression, that of the
/// last one if it is not whole, and what each has after it; then the blocks.
std::string decompressed(const VtpFile& file, ArrayBytes bytes) {
  const std::uint64_t block_count = bytes.number();
  if (block_count == 0) return {};
  const std::uint64_t block_size = bytes.number();
  const std::uint64_t last_size = bytes.number();
  if (block_count > bytes.left() / file.size_bytes) bytes.fail_damaged();
  std::vector<std::uint64_t> packed_sizes;
  for (std::uint64_t n = 0; n < block_count; ++n) packed_sizes.push_back(bytes.number());
  std::string result;
  for (std::uint64_t n = 0; n < block_count; ++n) {
    const bool is_short = n + 1 == block_count && last_size != 0;
    const auto block = inflated(bytes.take(packed_sizes[n]), is_short ? last_size : block_size);
    if (!block) bytes.fail_damaged();
    result += *block;
  }
  return result;
}

template <class Stored>
std::vector<double> converted(std::string_view bytes) {
  std::vector<double> values(bytes.size() / sizeof(Stored));
  for (std::size_t i = 0; i < values.size(); ++i) {
    Stored value;
    std::memcpy(&value, bytes.data() + i * sizeof(Stored), sizeof(Stored));
    values[i] = static_cast<double>(value);
  }
  return values;
}

std::vector<double> numbers_of(const VtpFile& file, std::string_view type, std::string_view bytes) {
  if (type == "Float32") return converted<float>(bytes);
  if (type == "Float64") return converted<double>(bytes);
  if (type == "Int8") return converted<std::int8_t>(bytes);
  if (type == "UInt8") return converted<std::uint8_t>(bytes);
  if (type == "Int16") return converted<std::int16_t>(bytes);
  if (type == "UInt16") return converted<std::uint16_t>(bytes);
  if (type == "Int32") return converted<std::int32_t>(bytes);
  if (type == "UInt32") return converted<std::uint32_t>(bytes);
  if (type == "Int64") return converted<std::int64_t>(bytes);
  if (type == "UInt64") return converted<std::uint64_t>(bytes);
  file.fail("has an array of the unknown type " + in_quotes(type));
}

/// The values of an array: behind its size, or in compressed blocks.
std::vector<double> numbers_of_bytes(const VtpFile& file, std::string_view type,
                                     std::string_view bytes, const char* array) {
  ArrayBytes rest(file, bytes, array);
  if (file.is_compressed) return numbers_of(file, type, decompressed(file, rest));
  return numbers_of(file, type, rest.take(rest.number()));
}

std::vector<double> numbers_of_text(const VtpFile& file, const MeshText& text) {
  WordReader reader(text);
  std::vector<double> values;
  for (std::string_view word = reader.word_across_lines(); !word.empty();
       word = reader.word_across_lines()) {
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
      file.fail(in_quotes(word) + " in an array is not a number");
    }
    values.push_back(value);
  }
  return values;
}

/// A number that counts or names something.
std::int64_t integer(const VtpFile& file, const char* array, double value, double largest) {
  if (!(value >= 0 && value <= largest && value == std::trunc(value))) {
    file.fail("has " + number_text(value) + " in its array " + array +
              "; whole numbers from 0 to " + std::to_string(static_cast<std::int64_t>(largest)) +
              " are wanted");
  }
  return static_cast<std::int64_t>(value);
}

/// The values of a DataArray in any of the ways VTK stores them. Integers are exact up to 2^53.
std::vector<double> read_array(const VtpFile& file, const pugi::xml_node& array) {
  const std::string_view format = array.attribute("format").as_string("ascii");
  const char* name = array.attribute("Name").as_string("without a name");
  const std::string_view type = array.attribute("type").value();
  if (format == "ascii") return numbers_of_text(file, {file.name, array.text().get()});
  if (format == "binary") {
    const std::string bytes = decode_base64(file, array.text().get());
    return numbers_of_bytes(file, type, bytes, name);
  }
  if (format != "appended") file.fail("has an array of the unknown format " + std::string(format));
  const std::size_t offset = array.attribute("offset").as_ullong();
  if (offset >= file.appended.size()) file.fail(std::string("ends before the array ") + name);
  const std::string_view rest = file.appended.substr(offset);
  if (!file.appended_is_base64) return numbers_of_bytes(file, type, rest, name);
  const std::string bytes = decode_base64(file, rest);
  return numbers_of_bytes(file, type, bytes, name);
}

std::vector<double> read_named(const VtpFile& file, const pugi::xml_node& parent,
                               const char* name) {
  const pugi::xml_node array = parent.find_child_by_attribute("DataArray", "Name", name);
  if (!array) file.fail(std::string("has no array ") + name);
  return read_array(file, array);
}

/// Calls visit(corners) for each cell of a kind, and returns how many there are.
///
/// Throws: InputError if there are fewer than the piece states. More are read all.
template <class Visit>
std::size_t visit_cells(const VtpFile& file, const pugi::xml_node& piece, const std::string& kind,
                        const Visit& visit) {
  const pugi::xml_node cells = piece.child(kind.c_str());
  const pugi::xml_attribute stated = piece.attribute(("NumberOf" + kind).c_str());
  std::vector<double> connectivity;
  std::vector<double> offsets;
  if (cells.child("DataArray") || stated.as_ullong() > 0) {
    connectivity = read_named(file, cells, "connectivity");
    offsets = read_named(file, cells, "offsets");
  }
  if (stated.as_ullong() > offsets.size()) {
    file.fail("states " + std::string(stated.name()) + "=\"" + std::to_string(stated.as_ullong()) +
              "\" and holds " + std::to_string(offsets.size()));
  }
  const auto corner_count = static_cast<std::int64_t>(connectivity.size());
  const auto check = [&](bool fits) {
    if (!fits) file.fail("has offsets of " + kind + " that do not fit its connectivity");
  };
  std::vector<std::int64_t> corners;
  std::int64_t begin = 0;
  for (const double offset : offsets) {
    const std::int64_t end = integer(file, "offsets", offset, 0x1p53);
    check(end >= begin && end <= corner_count);
    corners.clear();
    for (std::int64_t i = begin; i < end; ++i) {
      const double corner = connectivity[static_cast<std::size_t>(i)];
      corners.push_back(integer(file, "connectivity", corner, 0x1p32));
    }
    visit(corners);
    begin = end;
  }
  check(begin == corner_count);
  return offsets.size();
}

/// The surface of a piece, and of what cell each triangle is a part.
struct Surface {
  RawMesh mesh;
  std::vector<std::size_t> cell;
  std::size_t cell_count = 0;
};

void read_points(const VtpFile& file, const pugi::xml_node& piece, RawMesh& mesh) {
  const pugi::xml_node points = piece.child("Points").child("DataArray");
  if (!points) file.fail("has no points");
  const std::vector<double> xyz = read_array(file, points);
  if (xyz.size() != 3 * piece.attribute("NumberOfPoints").as_ullong()) {
    file.fail("holds another number of coordinates than its points need");
  }
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) {
    mesh.vertices.push_back(Vec3f(Vec3d{xyz[i], xyz[i + 1], xyz[i + 2]}));
  }
}

/// Arrays over cells have vertices and lines first, then polygons, then strips.
Surface read_surface(const VtpFile& file, const pugi::xml_node& piece) {
  Surface surface;
  RawMesh& mesh = surface.mesh;
  read_points(file, piece, mesh);
  const auto leave_out = [](const std::vector<std::int64_t>& /*corners*/) {};
  const std::size_t vertex_count = visit_cells(file, piece, "Verts", leave_out);
  const std::size_t line_count = visit_cells(file, piece, "Lines", leave_out);
  if (vertex_count > 0) {
    mesh.left_out.push_back(counted(vertex_count, "cell") + " of vertices alone");
  }
  if (line_count > 0) mesh.left_out.push_back(counted(line_count, "line"));
  std::size_t cell = vertex_count + line_count;
  const auto check = [&file](const std::vector<std::int64_t>& corners, const char* kind) {
    if (corners.size() < 3)
      file.fail(std::string("has a ") + kind + " of fewer than three corners");
  };
  visit_cells(file, piece, "Polys", [&](const std::vector<std::int64_t>& polygon) {
    check(polygon, "polygon");
    mesh.add_polygon(polygon);
    surface.cell.resize(mesh.triangles.size(), cell++);
  });
  visit_cells(file, piece, "Strips", [&](const std::vector<std::int64_t>& strip) {
    check(strip, "strip");
    mesh.add_strip(strip);
    surface.cell.resize(mesh.triangles.size(), cell++);
  });
  surface.cell_count = cell;
  return surface;
}

pugi::xml_node only_piece(const VtpFile& file) {
  const pugi::xml_node piece = file.xml.child("VTKFile").child("PolyData").child("Piece");
  if (!piece) file.fail("has no piece of polydata");
  if (piece.next_sibling("Piece")) file.fail("has several pieces; write it as one");
  return piece;
}

void note_arrays(const pugi::xml_node& data, const std::string& what, std::string_view but,
                 RawMesh& mesh) {
  std::string names;
  for (const pugi::xml_node& array : data.children("DataArray")) {
    const std::string_view name = array.attribute("Name").value();
    if (name != but) names += ' ' + in_quotes(name);
  }
  if (!names.empty()) mesh.data_left_out.push_back(what + names);
}

}  // namespace

std::string vtp_bytes(const TriMesh& mesh, const MeshFields& fields) {
  static_assert(std::endian::native == std::endian::little);
  VtpWriter writer;
  writer.xml =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  <PolyData>\n";
  writer.xml += field_data(fields);
  writer.xml += "    <Piece NumberOfPoints=\"" + std::to_string(mesh.vertices.size()) +
                "\" NumberOfPolys=\"" + std::to_string(mesh.triangles.size()) +
                "\">\n      <PointData>\n";
  writer.add_fields(fields.vertices, mesh.vertices.size());
  writer.xml += "      </PointData>\n      <CellData>\n";
  if (!mesh.materials.empty()) {
    writer.add("material", std::span<const std::uint16_t>(mesh.materials));
  }
  writer.add_fields(fields.facets, mesh.triangles.size());
  writer.xml += "      </CellData>\n      <Points>\n";
  writer.add("points", std::span<const Vec3f>(mesh.vertices));
  writer.xml += "      </Points>\n      <Polys>\n";
  add_polygons(writer, mesh);
  writer.xml += "      </Polys>\n    </Piece>\n  </PolyData>\n  <AppendedData encoding=\"raw\">\n_";
  return writer.xml + writer.appended + "\n  </AppendedData>\n</VTKFile>\n";
}

std::string vtu_bytes(const TriMesh& mesh) {
  VtpWriter writer;
  writer.xml =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  <UnstructuredGrid>\n    <Piece "
      "NumberOfPoints=\"" +
      std::to_string(mesh.vertices.size()) + "\" NumberOfCells=\"" +
      std::to_string(mesh.triangles.size()) + "\">\n      <CellData>\n";
  if (!mesh.materials.empty())
    writer.add("material", std::span<const std::uint16_t>(mesh.materials));
  writer.xml += "      </CellData>\n      <Points>\n";
  writer.add("points", std::span<const Vec3f>(mesh.vertices));
  writer.xml += "      </Points>\n      <Cells>\n";
  add_polygons(writer, mesh);
  constexpr std::uint8_t vtk_triangle = 5;
  const std::vector<std::uint8_t> types(mesh.triangles.size(), vtk_triangle);
  writer.add("types", std::span<const std::uint8_t>(types));
  writer.xml +=
      "      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n  <AppendedData "
      "encoding=\"raw\">\n_";
  return writer.xml + writer.appended + "\n  </AppendedData>\n</VTKFile>\n";
}

RawMesh read_vtp(const MeshText& text) {
  VtpFile file{.name = text.name, .xml = {}, .appended = {}};
  parse_xml(file, text.content);
  const pugi::xml_node piece = only_piece(file);
  Surface surface = read_surface(file, piece);
  const pugi::xml_node cells = piece.child("CellData");
  if (cells.find_child_by_attribute("DataArray", "Name", "material")) {
    const std::vector<double> ids = read_named(file, cells, "material");
    if (ids.size() != surface.cell_count) {
      file.fail("has " + counted(ids.size(), "value") + " in its array material for " +
                counted(surface.cell_count, "cell"));
    }
    for (const std::size_t cell : surface.cell) {
      constexpr double largest = std::numeric_limits<MaterialId>::max();
      surface.mesh.materials.push_back(
          static_cast<MaterialId>(integer(file, "material", ids[cell], largest)));
    }
  }
  note_arrays(piece.child("PointData"), "point data", "", surface.mesh);
  note_arrays(cells, "cell data", "material", surface.mesh);
  return std::move(surface.mesh);
}

std::vector<FacetArray> read_facet_arrays(const std::filesystem::path& path) {
  const std::string name = shown(path);
  const std::string content = read_file(path);
  VtpFile file{.name = name, .xml = {}, .appended = {}};
  parse_xml(file, content);
  const pugi::xml_node piece = only_piece(file);
  const Surface surface = read_surface(file, piece);
  std::vector<FacetArray> arrays;
  for (const pugi::xml_node& array : piece.child("CellData").children("DataArray")) {
    const std::vector<double> values = read_array(file, array);
    if (values.size() != surface.cell_count) continue;
    arrays.push_back({.name = array.attribute("Name").value(), .values = {}});
    for (const std::size_t cell : surface.cell) {
      arrays.back().values.push_back(static_cast<float>(values[cell]));
    }
  }
  return arrays;
}

std::vector<std::string> read_material_names(const std::filesystem::path& path) {
  const std::string name = shown(path);
  const std::string content = read_file(path);
  VtpFile file{.name = name, .xml = {}, .appended = {}};
  parse_xml(file, content);
  const pugi::xml_node data = file.xml.child("VTKFile").child("PolyData").child("FieldData");
  const pugi::xml_node array = data.find_child_by_attribute("DataArray", "Name", "material_names");
  std::vector<std::string> names;
  std::string text;
  if (!array) return names;
  for (const double value : numbers_of_text(file, {name, array.text().get()})) {
    const std::int64_t code = integer(file, "material_names", value, 255);
    if (code != 0) {
      text += static_cast<char>(static_cast<unsigned char>(code));
    } else {
      names.push_back(std::exchange(text, ""));
    }
  }
  return names;
}

void write_series(const std::filesystem::path& file, std::span<const std::string> outputs) {
  std::string xml =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" "
      "byte_order=\"LittleEndian\">\n  <Collection>\n";
  for (std::size_t n = 0; n < outputs.size(); ++n) {
    xml += "    <DataSet timestep=\"" + std::to_string(n) + "\" part=\"0\" file=\"" +
           escaped(outputs[n]) + "\"/>\n";
  }
  write_file(file, xml + "  </Collection>\n</VTKFile>\n");
}

}  // namespace scarp
