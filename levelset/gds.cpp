#include "levelset/gds.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/quantity.h"
#include "core/read_file.h"
#include "core/suggestion.h"

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

/// More shapes than this are taken for a mistake.
constexpr std::size_t most_loops = 1'000'000;

/// Cells within cells; layouts have ten or twenty.
constexpr int most_levels = 200;

struct Element {
  int kind = 0;
  int layer = 0;
  int datatype = 0;
  double width = 0;
  int path_type = 0;
  double begin_extension = 0;
  double end_extension = 0;
  std::vector<Point2> points{};
  std::string cell{};
  int columns = 1;
  int rows = 1;
  bool mirrored = false;
  double magnification = 1;
  double angle = 0;  ///< degrees
};

struct Library {
  std::map<std::string, std::vector<Element>> cells;
  double unit = 1;  ///< nm
};

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& text) {
  throw InputError(file.string() + ": " + text);
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
      refuse(file_, "ends early, at byte " + std::to_string(bytes_.size()) +
                        ", without the end of the library; write or copy it again");
    }
    const std::size_t length = byte(at_) << 8 | byte(at_ + 1);
    kind_ = static_cast<int>(byte(at_ + 2));
    if (at_ == 0 && (kind_ != header || length != 6)) {
      refuse(file_, "is not a GDSII file: it does not start with a header");
    }
    if (length < 4)
      refuse(file_, "is damaged: a record of length 0 at byte " + std::to_string(at_) +
                        "; write or copy it again");
    if (at_ + length > bytes_.size()) {
      refuse(file_, "ends early, within a record that starts at byte " + std::to_string(at_) +
                        "; write or copy it again");
    }
    end_ = at_ + length;
  }

  std::size_t size() const { return end_ - at_ - 4; }

  int short_integer(std::size_t index = 0) const {
    return static_cast<std::int16_t>(unsigned_integer(2 * index, 2));
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
      refuse(file_, "is damaged: the record at byte " + std::to_string(at_) +
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

void read_property(const Reader& reader, Element& element) {
  switch (reader.kind()) {
    case layer_number:
      element.layer = reader.short_integer();
      break;
    case data_type:
    case box_type:
      element.datatype = reader.short_integer();
      break;
    case width:
      element.width = reader.integer();
      break;
    case path_type:
      element.path_type = reader.short_integer();
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
      element.columns = reader.short_integer(0);
      element.rows = reader.short_integer(1);
      break;
    case transformation:
      element.mirrored = (reader.short_integer() & 0x8000) != 0;
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

std::vector<Element> read_cell(Reader& reader) {
  const std::set<int> kinds{boundary, path, box, cell_reference, array_reference};
  std::vector<Element> elements;
  for (; reader.kind() != end_cell; reader.next()) {
    if (!kinds.contains(reader.kind())) continue;
    Element element{.kind = reader.kind()};
    for (reader.next(); reader.kind() != end_element; reader.next()) {
      read_property(reader, element);
    }
    elements.push_back(std::move(element));
  }
  return elements;
}

Library read_library(const std::filesystem::path& file, std::string_view content) {
  Reader reader(file, content);
  Library library;
  for (; reader.kind() != end_library; reader.next()) {
    if (reader.kind() == units) library.unit = reader.real(1) * 1e9;
    if (reader.kind() != cell_name) continue;
    const std::string name = reader.text();
    reader.next();
    library.cells[name] = read_cell(reader);
  }
  if (!(library.unit > 0)) refuse(file, "has a database unit that is not above 0");
  return library;
}

/// A linear map and a shift.
struct Placement {
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Identity();
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();

  Point2 operator()(const Point2& r) const {
    const Eigen::Vector2d place = matrix * Eigen::Vector2d(r[0], r[1]) + shift;
    return {place[0], place[1]};
  }
  double scale() const { return std::sqrt(std::abs(matrix.determinant())); }
};

/// First mirrored about the x axis, then magnified, turned and shifted; turns by quarters are
/// exact.
Placement placement_of(const Element& element, const Point2& at) {
  const double quarters = element.angle / 90;
  double cosine = std::cos(element.angle * std::numbers::pi / 180);
  double sine = std::sin(element.angle * std::numbers::pi / 180);
  if (quarters == std::floor(quarters)) {
    cosine = std::round(cosine);
    sine = std::round(sine);
  }
  const double m = element.magnification;
  const double y = element.mirrored ? -m : m;
  Placement placement{.shift = {at[0], at[1]}};
  placement.matrix << m * cosine, -y * sine, m * sine, y * cosine;
  return placement;
}

Placement combined(const Placement& outer, const Placement& inner) {
  return {outer.matrix * inner.matrix, outer.matrix * inner.shift + outer.shift};
}

Point2 moved(const Point2& r, const Point2& u, double s) {
  return {r[0] + s * u[0], r[1] + s * u[1]};
}

/// The direction from a to b and, by left, the one to its left.
Point2 direction(const Point2& a, const Point2& b) {
  const double x = b[0] - a[0];
  const double y = b[1] - a[1];
  const double norm = std::sqrt(x * x + y * y);
  return {x / norm, y / norm};
}
Point2 left_of(const Point2& u) { return {-u[1], u[0]}; }

/// Mitred up to right angles and somewhat beyond, bevelled where they are sharper.
Loop joint(const Point2& corner, const Point2& u, const Point2& v, double half) {
  const double side = u[0] * v[1] - u[1] * v[0] > 0 ? -1 : 1;
  const Point2 n = left_of(u);
  const Point2 m = left_of(v);
  Loop loop{corner, moved(corner, n, side * half), moved(corner, m, side * half)};
  const double cosine = u[0] * v[0] + u[1] * v[1];
  if (cosine > -0.1) {
    const Point2 sum{n[0] + m[0], n[1] + m[1]};
    loop.insert(loop.begin() + 2, moved(corner, sum, side * half / (1 + cosine)));
  }
  return loop;
}

Loop disc(const Point2& centre, double radius) {
  constexpr int corners = 48;
  Loop loop;
  for (int n = 0; n < corners; ++n) {
    const double phase = 2 * std::numbers::pi * n / corners;
    loop.push_back({centre[0] + radius * std::cos(phase), centre[1] + radius * std::sin(phase)});
  }
  return loop;
}

/// A rectangle per piece of the path, and what fills the corners between them.
std::vector<Loop> path_loops(const Element& element, double half) {
  std::vector<Point2> line;
  for (const Point2& point : element.points) {
    if (line.empty() || line.back() != point) line.push_back(point);
  }
  std::vector<Loop> loops;
  if (line.size() < 2 || half <= 0) return loops;
  const bool square = element.path_type == 2;
  const bool custom = element.path_type == 4;
  for (std::size_t p = 0; p + 1 < line.size(); ++p) {
    const Point2 u = direction(line[p], line[p + 1]);
    const Point2 n = left_of(u);
    const bool first = p == 0;
    const bool last = p + 2 == line.size();
    const double before = !first ? 0 : square ? half : custom ? element.begin_extension : 0;
    const double after = !last ? 0 : square ? half : custom ? element.end_extension : 0;
    const Point2 a = moved(line[p], u, -before);
    const Point2 b = moved(line[p + 1], u, after);
    loops.push_back({moved(a, n, -half), moved(b, n, -half), moved(b, n, half), moved(a, n, half)});
    if (!last) loops.push_back(joint(line[p + 1], u, direction(line[p + 1], line[p + 2]), half));
  }
  if (element.path_type == 1) {
    loops.push_back(disc(line.front(), half));
    loops.push_back(disc(line.back(), half));
  }
  return loops;
}

/// What a layout draws on the chosen layer.
bool is_chosen(const Element& element, const GdsSelection& selection) {
  return element.layer == selection.layer &&
         (!selection.datatype || element.datatype == *selection.datatype);
}

bool is_reference(const Element& element) {
  return element.kind == cell_reference || element.kind == array_reference;
}

/// The loops of one shape in its cell; a negative width of a path is not magnified.
std::vector<Loop> loops_of(const Element& element, double scale) {
  std::vector<Loop> loops{element.points};
  if (element.kind == path) {
    const double width = element.width < 0 ? -element.width / scale : element.width;
    loops = path_loops(element, 0.5 * width);
  }
  for (Loop& loop : loops) {
    if (!loop.empty() && loop.front() == loop.back()) loop.pop_back();
  }
  std::erase_if(loops, [](const Loop& loop) { return loop.size() < 3; });
  return loops;
}

/// Counts what cells draw on the chosen layer before any of it is written out: references of
/// references can multiply it, or nothing at all, without end.
class Census {
 public:
  Census(const std::filesystem::path& file, const Library& library, const GdsSelection& selection)
      : file_(file), library_(library), selection_(selection) {}

  /// Loops of a cell and of all below it.
  double loop_count(const std::string& cell) { return count(cell, 1).loops; }

  const std::set<std::pair<int, int>>& layers() const { return layers_; }

 private:
  struct Count {
    double loops = 0;
    int levels = 0;  ///< of cells, this one included
    bool is_open = true;
  };

  const Count& count(const std::string& cell, int level) {
    const auto found = library_.cells.find(cell);
    if (found == library_.cells.end())
      refuse(file_, "refers to a cell that it lacks: " + cell + "; write it with all its cells");
    const auto [place, is_new] = counts_.try_emplace(cell);
    Count& sum = place->second;
    if (!is_new && sum.is_open)
      refuse(file_, "cell " + cell + " contains itself; break the circle in the layout");
    if (level + sum.levels > most_levels) {
      refuse(file_, "cell " + cell + " is " + std::to_string(most_levels) +
                        " or more references below the one that is read; flatten it");
    }
    if (!is_new) return sum;
    for (const Element& element : found->second) {
      if (is_reference(element)) {
        check_reference(cell, element);
        const Count& inner = count(element.cell, level + 1);
        sum.loops += static_cast<double>(element.columns) * element.rows * inner.loops;
        sum.levels = std::max(sum.levels, inner.levels);
        continue;
      }
      layers_.insert({element.layer, element.datatype});
      if (is_chosen(element, selection_)) {
        sum.loops += static_cast<double>(loops_of(element, 1).size());
      }
    }
    ++sum.levels;
    sum.is_open = false;
    return sum;
  }

  void check_reference(const std::string& cell, const Element& element) const {
    const bool is_array = element.kind == array_reference;
    if (element.points.size() < (is_array ? 3U : 1U) || element.columns < 1 || element.rows < 1) {
      refuse(file_, "cell " + cell + " has a damaged reference to " + element.cell);
    }
  }

  const std::filesystem::path& file_;
  const Library& library_;
  const GdsSelection& selection_;
  std::map<std::string, Count> counts_;
  std::set<std::pair<int, int>> layers_;
};

/// Walks a cell and all that it refers to.
class Flattener {
 public:
  Flattener(const std::filesystem::path& file, const Library& library,
            const GdsSelection& selection)
      : file_(file), library_(library), selection_(selection), census_(file, library, selection) {}

  std::vector<Loop> run(const std::string& cell) {
    const double count = census_.loop_count(cell);
    if (count == 0) refuse_layer(cell);
    if (count > most_loops) {
      refuse(file_, "cell " + cell + " has more than " + std::to_string(most_loops) +
                        " shapes on the layer; choose a smaller cell");
    }
    place(cell, {});
    return std::move(loops_);
  }

 private:
  void place(const std::string& cell, const Placement& placement) {
    for (const Element& element : library_.cells.at(cell)) {
      if (!is_reference(element)) {
        if (is_chosen(element, selection_)) draw(element, placement);
      } else if (census_.loop_count(element.cell) > 0) {
        refer(element, placement);
      }
    }
  }

  void refer(const Element& element, const Placement& placement) {
    const bool is_array = element.kind == array_reference;
    const Point2& origin = element.points[0];
    for (int column = 0; column < element.columns; ++column) {
      for (int row = 0; row < element.rows; ++row) {
        Point2 at = origin;
        for (std::size_t axis = 0; is_array && axis < 2; ++axis) {
          at[axis] += column * (element.points[1][axis] - origin[axis]) / element.columns +
                      row * (element.points[2][axis] - origin[axis]) / element.rows;
        }
        place(element.cell, combined(placement, placement_of(element, at)));
      }
    }
  }

  void draw(const Element& element, const Placement& placement) {
    for (Loop& loop : loops_of(element, placement.scale())) {
      for (Point2& point : loop) {
        point = placement(point);
        for (double& x : point) {
          x *= library_.unit;
          if (!(std::abs(x) <= longest_length)) {
            refuse(file_, "has a point more than 1 m away from its origin; is its database unit (" +
                              rounded_number(library_.unit) + " nm) right?");
          }
        }
      }
      loops_.push_back(std::move(loop));
    }
  }

  [[noreturn]] void refuse_layer(const std::string& cell) const {
    std::string known;
    for (const auto& [layer, datatype] : census_.layers()) {
      known += (known.empty() ? "" : ", ") + std::to_string(layer) + '/' + std::to_string(datatype);
    }
    refuse(file_, "cell " + cell + " has nothing on layer " + std::to_string(selection_.layer) +
                      (selection_.datatype ? '/' + std::to_string(*selection_.datatype) : "") +
                      (known.empty() ? "; it is empty" : "; it has layer/datatype " + known));
  }

  const std::filesystem::path& file_;
  const Library& library_;
  const GdsSelection& selection_;
  Census census_;
  std::vector<Loop> loops_;
};

std::string chosen_cell(const std::filesystem::path& file, const Library& library,
                        const std::string& wanted) {
  std::vector<std::string> names;
  std::set<std::string> inner;
  for (const auto& [name, elements] : library.cells) {
    names.push_back(name);
    for (const Element& element : elements) inner.insert(element.cell);
  }
  if (!wanted.empty()) {
    if (library.cells.contains(wanted)) return wanted;
    constexpr std::size_t most_told = 10;
    std::string told;
    for (std::size_t n = 0; n < std::min(names.size(), most_told); ++n) {
      told += (n > 0 ? ", " : "") + names[n];
    }
    refuse(file, "has no cell " + wanted + suggestion(wanted, names) + "; it has " + told +
                     (names.size() > most_told ? ", ..." : ""));
  }
  std::string known;
  std::size_t count = 0;
  std::string top;
  for (const std::string& name : names) {
    if (inner.contains(name)) continue;
    top = name;
    known += (count++ > 0 ? ", " : "") + name;
  }
  if (count != 1) {
    refuse(file, count == 0 ? "has no cell that no other refers to; name one with cell = ..."
                            : "has several cells that no other refers to; choose one with cell = "
                              "...: " +
                                  known);
  }
  return top;
}

}  // namespace

std::vector<Loop> read_gds(const std::filesystem::path& file, const GdsSelection& selection) {
  return read_gds(file, read_file(file), selection);
}

std::vector<Loop> read_gds(const std::filesystem::path& file, std::string_view content,
                           const GdsSelection& selection) {
  const Library library = read_library(file, content);
  return Flattener(file, library, selection).run(chosen_cell(file, library, selection.cell));
}

}  // namespace scarp
