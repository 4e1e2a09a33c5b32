#include "levelset/start/gds_library.h"

#include <cmath>
#include <cstdint>

#include "core/error.h"
#include "core/printable.h"
#include "core/system/deflate.h"

namespace scarp {

namespace {

enum Record : int {
  header = 0x00,
  units = 0x03,
  end_library = 0x04,
  begin_cell = 0x05,
  cell_name = 0x06,
  end_cell = 0x07,
  boundary = 0x08,
  path = 0x09,
  cell_reference = 0x0a,
  array_reference = 0x0b,
  layer_number = 0x0d,
  data_type = 0x0e,
  width = 0x0f,
  points = 0x10,
  end_element = 0x11,
  referred_name = 0x12,
  columns_rows = 0x13,
  transformation = 0x1a,
  magnification = 0x1b,
  angle = 0x1c,
  path_type = 0x21,
  box = 0x2d,
  box_type = 0x2e,
  begin_extension = 0x30,
  end_extension = 0x31,
};

bool is_gzip(std::string_view content) { return content.starts_with("\x1f\x8b"); }

std::string unpacked_content(const std::filesystem::path& file, std::string_view content) {
  constexpr std::size_t most = std::size_t{1} << 31;
  try {
    return gunzipped(content, most);
  } catch (const InputError& error) {
    refuse_layout(file, error.what());
  }
}

/// The records of a file, one after the other.
class Reader {
 public:
  Reader(const std::filesystem::path& file, std::string_view bytes) : file_(file), bytes_(bytes) {
    next();
  }

  int kind() const { return kind_; }

  void next() {
    at_ = end_;
    if (at_ + 4 > bytes_.size()) {
      refuse_layout(file_, "ends early, at byte " + std::to_string(bytes_.size()) +
                               ", without the end of the library; write or copy it again");
    }
    const std::size_t length = byte(at_) << 8 | byte(at_ + 1);
    kind_ = static_cast<int>(byte(at_ + 2));
    if (at_ == 0 && (kind_ != header || length != 6)) {
      refuse_layout(file_, "is not a GDSII file: it does not start with a header");
    }
    if (length < 4)
      refuse_layout(file_, "is damaged: a record of length 0 at byte " + std::to_string(at_) +
                               "; write or copy it again");
    if (at_ + length > bytes_.size()) {
      refuse_layout(file_, "ends early, within a record that starts at byte " +
                               std::to_string(at_) + "; write or copy it again");
    }
    end_ = at_ + length;
  }

  std::size_t size() const { return end_ - at_ - 4; }

  /// Counts and numbers of layers, which go to 65535 in files of today.
  int short_count(std::size_t index = 0) const {
    return static_cast<int>(unsigned_integer(2 * index, 2));
  }
  int integer(std::size_t index = 0) const {
    return static_cast<std::int32_t>(unsigned_integer(4 * index, 4));
  }

  /// Sign, power of 16 and 56 bits of mantissa.
  double real(std::size_t index = 0) const {
    const std::uint64_t bits = unsigned_integer(8 * index, 8);
    const int exponent = static_cast<int>(bits >> 56 & 0x7f) - 64;
    const auto mantissa = static_cast<double>(bits & 0xffffffffffffffU);
    const double value = std::ldexp(mantissa, 4 * exponent - 56);
    return (bits >> 63) != 0 ? -value : value;
  }

  std::string text() const {
    std::string name(bytes_.begin() + static_cast<std::ptrdiff_t>(at_ + 4),
                     bytes_.begin() + static_cast<std::ptrdiff_t>(end_));
    while (!name.empty() && name.back() == '\0') name.pop_back();
    return name;
  }

 private:
  std::size_t byte(std::size_t at) const { return static_cast<unsigned char>(bytes_[at]); }

  std::uint64_t unsigned_integer(std::size_t offset, std::size_t count) const {
    if (offset + count > size()) {
      refuse_layout(file_, "is damaged: the record at byte " + std::to_string(at_) +
                               " is too short; write or copy it again");
    }
    std::uint64_t value = 0;
    for (std::size_t n = 0; n < count; ++n) value = value << 8 | byte(at_ + 4 + offset + n);
    return value;
  }

  std::filesystem::path file_;
  std::string_view bytes_;
  std::size_t at_ = 0;
  std::size_t end_ = 0;
  int kind_ = -1;
};

void read_property(const Reader& reader, GdsElement& element) {
  switch (reader.kind()) {
    case layer_number:
      element.layer = reader.short_count();
      break;
    case data_type:
    case box_type:
      element.datatype = reader.short_count();
      break;
    case width:
      element.width = reader.integer();
      break;
    case path_type:
      element.path_type = reader.short_count();
      break;
    case begin_extension:
      element.begin_extension = reader.integer();
      break;
    case end_extension:
      element.end_extension = reader.integer();
      break;
    case referred_name:
      element.cell = reader.text();
      break;
    case columns_rows:
      element.columns = reader.short_count(0);
      element.rows = reader.short_count(1);
      break;
    case transformation:
      element.mirrored = (reader.short_count() & 0x8000) != 0;
      break;
    case magnification:
      element.magnification = reader.real();
      break;
    case angle:
      element.angle = reader.real();
      break;
    case points:
      for (std::size_t n = 0; n < reader.size() / 8; ++n) {
        element.points.push_back({static_cast<double>(reader.integer(2 * n)),
                                  static_cast<double>(reader.integer(2 * n + 1))});
      }
      break;
    default:
      break;
  }
}

std::vector<GdsElement> read_cell(Reader& reader) {
  using Kind = GdsElement::Kind;
  const std::map<int, Kind> kinds{{boundary, Kind::boundary},
                                  {box, Kind::box},
                                  {path, Kind::path},
                                  {cell_reference, Kind::cell_reference},
                                  {array_reference, Kind::array_reference}};
  std::vector<GdsElement> elements;
  for (; reader.kind() != end_cell; reader.next()) {
    const auto kind = kinds.find(reader.kind());
    if (kind == kinds.end()) continue;
    GdsElement element{.kind = kind->second};
    for (reader.next(); reader.kind() != end_element; reader.next()) {
      read_property(reader, element);
    }
    elements.push_back(std::move(element));
  }
  return elements;
}

}  // namespace

void refuse_layout(const std::filesystem::path& file, const std::string& text) {
  throw InputError(shown(file) + ": " + one_line(text));
}

GdsLibrary read_gds_library(const std::filesystem::path& file, std::string_view content) {
  constexpr std::string_view oasis = "%SEMI-OASIS";
  if (content.starts_with(oasis))
    refuse_layout(file,
                  "is an OASIS file; convert it to GDSII, for example with strm2gds of KLayout");
  std::string unpacked;
  if (is_gzip(content)) {
    unpacked = unpacked_content(file, content);
    content = unpacked;
  }
  Reader reader(file, content);
  GdsLibrary library;
  for (; reader.kind() != end_library; reader.next()) {
    if (reader.kind() == units) library.unit = reader.real(1) * 1e9;
    if (reader.kind() != cell_name) continue;
    const std::string name = reader.text();
    reader.next();
    if (!library.cells.emplace(name, read_cell(reader)).second)
      refuse_layout(file,
                    "has two cells that are named " + repeated(name) + "; rename one of them");
  }
  if (!(library.unit > 0)) refuse_layout(file, "has a database unit that is not above 0");
  return library;
}

}  // namespace scarp
