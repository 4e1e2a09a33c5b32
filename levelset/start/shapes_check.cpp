#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/recipe/quantity.h"
#include "levelset/grid/welded.h"
#include "levelset/start/mesh_solid.h"
#include "levelset/start/polygon_walls.h"
#include "levelset/start/shape_builder.h"
#include "levelset/start/shapes.h"

namespace scarp {

namespace {

/// Features thinner than this many spacings are refused: the band cannot hold both their sides.
constexpr double thinnest = 2;

/// What a narrow place lies between: the walls of an opening, or the sides of a solid.
enum class Between { walls, sides };

/// Every layer is a level set of its own, and every point is compared with every shape.
constexpr std::size_t most_layers = 200;
constexpr std::size_t most_shapes = 1000;

/// From the deepest cut to the highest top, in spacings.
constexpr double most_levels = 1e5;

std::string in_nm(double length) { return rounded_number(length) + " nm"; }

/// The size across a shape, which a radius gives half of.
std::string size_text(const std::string& key, double size) {
  return (key.ends_with("radius") ? "a diameter of " : "") + in_nm(size);
}

/// A count that may be too large for an integer.
std::string whole_text(double count) {
  return count < 1e15 ? std::to_string(static_cast<long long>(count)) : "more than 1e15";
}

bool is_length(double length) { return std::isfinite(length) && length > 0; }

std::string prefix_of(const std::string& key) { return key.substr(0, key.rfind('.') + 1); }

std::string place(Vec3d r) {
  return '(' + in_nm(r.x) + ", " + in_nm(r.y) + ", " + in_nm(r.z) + ')';
}
std::string place(const std::array<double, 2>& corner) {
  return '(' + in_nm(corner[0]) + ", " + in_nm(corner[1]) + ')';
}

/// The widest place of an opening whose walls run from the mouth to the depth.
double widest(double width, const Cut& cut) {
  return std::max(width, width - 2 * cut.depth * std::tan(cut.taper));
}

/// What is wrong with the shapes, and the rules for single sizes.
class ShapeReport {
 public:
  /// Units: the least width of a feature in spacings.
  ShapeReport(const Frame& frame, double narrowest) : frame_(frame), narrowest_(narrowest) {}

  /// Of which shape is spoken from here on.
  void turn_to(std::size_t shape) { shape_ = shape; }
  std::vector<ShapeProblem> take() { return std::move(problems_); }

  void report(std::string key, std::string message) {
    problems_.push_back({shape_, std::move(key), std::move(message), false});
  }

  void report_narrow(std::string key, std::string message, Between between) {
    problems_.push_back({shape_, std::move(key), std::move(message), between == Between::walls});
  }

  double narrow() const { return narrowest_ * frame_.spacing; }

  bool is_narrow(double width) const { return width < narrow() * (1 - 1e-9); }

  /// "less than two grid spacings (20 nm)" without the first word.
  std::string than_spacings() const {
    const std::string count = narrowest_ == thinnest ? "two" : rounded_number(narrowest_);
    return "than " + count + " grid spacings (" + in_nm(narrow()) + ")";
  }

  /// A width that is not too narrow: a length, or twice a radius.
  bool feature(const std::string& key, double width, Between between) {
    if (!is_length(width)) {
      report(key, "must be a length above 0");
    } else if (is_narrow(width)) {
      report_narrow(key, size_text(key, width) + " is thinner " + than_spacings(), between);
    } else {
      return true;
    }
    return false;
  }

  /// A height of at least two spacings.
  bool height(const std::string& key, double length) {
    const double shortest = thinnest * frame_.spacing;
    if (!is_length(length)) {
      report(key, "must be a length above 0");
    } else if (length < shortest * (1 - 1e-9)) {
      report(key, in_nm(length) + " is thinner than two grid spacings (" + in_nm(shortest) + ")");
    } else {
      return true;
    }
    return false;
  }

  bool taper(double angle) {
    const bool is_good = std::abs(angle) < 0.49 * std::numbers::pi;
    if (!is_good) report("taper", "must lie between -88 deg and 88 deg");
    return is_good;
  }

  void radius(const std::string& key, double value, double largest) {
    if (!(value >= 0 && value <= largest * (1 + 1e-9))) {
      report(key, "must lie between 0 nm and " + in_nm(std::max(largest, 0.0)));
    }
  }

 private:
  const Frame& frame_;
  double narrowest_;
  std::size_t shape_ = 0;
  std::vector<ShapeProblem> problems_;
};

/// Where shapes lie between the sides of the domain, copies included.
class PlaceChecks {
 public:
  PlaceChecks(const Frame& frame, ShapeReport& report)
      : frame_(frame), sides_(frame.sides()), report_(report) {}

  /// Where a shape lies along an axis, copies included. key and centre_key are named in messages.
  struct Interval {
    std::string key;
    std::string centre_key;
    int axis = 0;
    double centre = 0;
    double width = 0;
    int count = 1;
    double pitch = 0;
    Between between = Between::walls;
  };

  /// Copies that do not overlap; the first and the last with their centres in the domain, none of
  /// which fills it, and walls that are not too thin between them and to the images
  /// beyond the sides.
  void interval(const Interval& s) {
    const Between others = s.between == Between::walls ? Between::sides : Between::walls;
    const double extent = sides_.width(s.axis);
    const double half_row = 0.5 * (s.count - 1) * s.pitch;
    const double slack = 1e-9 * extent;
    if (!(s.centre - half_row >= sides_.lower[s.axis] - slack &&
          s.centre + half_row <= sides_.upper[s.axis] + slack)) {
      const std::string allowed =
          in_nm(sides_.lower[s.axis]) + " and " + in_nm(sides_.upper[s.axis]);
      if (s.count > 1) {
        report_.report(
            prefix_of(s.centre_key) + "repeat",
            "puts the centre of a copy outside the domain; they must lie in the domain, between " +
                allowed);
      } else {
        report_.report(s.centre_key, "must lie in the domain, between " + allowed);
      }
      return;
    }
    const double left = s.centre - half_row - 0.5 * s.width - sides_.lower[s.axis];
    const double right = sides_.upper[s.axis] - s.centre - half_row - 0.5 * s.width;
    const bool periodic = frame_.boundary[s.axis] == Boundary::periodic;
    // Mirrored at a side, half of it may fill most of the domain: a quarter of a hole.
    const bool is_too_wide = periodic ? s.width >= extent - slack : std::max(left, right) <= slack;
    if (s.count == 1 && is_too_wide) {
      report_.report(s.key, size_text(s.key, s.width) + " is not narrower than the domain (" +
                                in_nm(extent) + ")");
      return;
    }
    if (s.count > 1 && !(s.pitch - s.width >= report_.narrow() * (1 - 1e-9))) {
      report_.report_narrow(prefix_of(s.centre_key) + "pitch",
                            "leaves " + in_nm(s.pitch - s.width) +
                                " between copies at their widest: less " + report_.than_spacings(),
                            others);
      return;
    }
    for (const double wall :
         {periodic ? left + right : 2 * left, periodic ? left + right : 2 * right}) {
      if (wall > (periodic && s.count > 1 ? -s.width : 0) && report_.is_narrow(wall)) {
        report_.report_narrow(s.key,
                              "leaves " + in_nm(wall) +
                                  " to its image beyond a side of the domain: less " +
                                  report_.than_spacings(),
                              others);
        return;
      }
    }
  }

  /// Counts and pitches that make sense.
  bool lattice(const std::string& prefix, const Repeat& repeat) {
    for (int axis = 0; axis < 2; ++axis) {
      if (repeat.count[axis] < 1) {
        report_.report(prefix + "repeat", "must be 1 or more");
        return false;
      }
      if (repeat.count[axis] > 1 &&
          !(std::isfinite(repeat.pitch[axis]) && repeat.pitch[axis] > 0)) {
        report_.report(prefix + "pitch", "must be a length above 0");
        return false;
      }
    }
    return true;
  }

  /// Whether a shape that is not round meets a frame that goes around an axis.
  bool is_lopsided(const std::string& prefix) {
    if (frame_.is_around_axis())
      report_.report(prefix + "shape", "is not the same all around the axis; use a round shape");
    return frame_.is_around_axis();
  }

  /// A slot, trench or fin: one interval across.
  void row(const std::string& prefix, int along, double centre, double widest, const Repeat& repeat,
           Between between) {
    if (is_lopsided(prefix)) return;
    if (!frame_.varies_along(1 - along)) {
      report_.report(prefix + "along", "must be \"y\" in two dimensions");
    } else if (lattice(prefix, repeat)) {
      const int axis = 1 - along;
      interval({prefix + "width", prefix + "center", axis, centre, widest, repeat.count[axis],
                repeat.pitch[axis], between});
    }
  }

  /// Whether the radius is good.
  bool round_outline(const std::string& prefix, const std::array<double, 2>& centre, double radius,
                     double widest_radius, const Repeat& repeat, Between between) {
    const bool is_good = report_.feature(prefix + "radius", 2 * radius, between);
    if (is_good && lattice(prefix, repeat)) {
      for (int axis = 0; axis < frame_.lateral_axes(); ++axis) {
        interval({prefix + "radius", prefix + "center", axis, centre[axis], 2 * widest_radius,
                  repeat.count[axis], repeat.pitch[axis], between});
      }
    }
    if (frame_.is_around_axis()) {
      if (centre[0] != 0 || centre[1] != 0)
        report_.report(prefix + "center", "must be on the axis, [0, 0]");
      if (repeat.count[0] != 1 || repeat.count[1] != 1)
        report_.report(prefix + "repeat", "there is room for one on the axis");
    } else if (frame_.is_slice()) {
      report_.report(prefix + "shape",
                     "round shapes need three dimensions, or mode = \"axisymmetric\"");
    }
    return is_good;
  }

  /// So long that its copies beyond periodic sides could not be counted.
  bool is_endless(const std::string& key, Point2 lower, Point2 upper) {
    constexpr double most_domains = 1000;
    for (int axis = 0; axis < 2; ++axis) {
      const double size = upper[axis] - lower[axis];
      const bool is_periodic = frame_.boundary[axis] == Boundary::periodic;
      if (!is_periodic || size <= most_domains * sides_.width(axis)) continue;
      report_.report(key, "is " + in_nm(size) + " long across a periodic side, more than " +
                              rounded_number(most_domains) +
                              " domains; choose another unit or a part of it");
      return true;
    }
    return false;
  }

  bool is_endless(const std::string& key, const std::vector<Loop>& loops) {
    return std::any_of(loops.begin(), loops.end(), [&](const Loop& loop) {
      Point2 lower = loop.front();
      Point2 upper = loop.front();
      for (const Point2& point : loop) {
        for (std::size_t axis = 0; axis < 2; ++axis) {
          lower[axis] = std::min(lower[axis], point[axis]);
          upper[axis] = std::max(upper[axis], point[axis]);
        }
      }
      return is_endless(key, lower, upper);
    });
  }

  void report_outside(const std::string& key) {
    report_.report(key, "lies wholly outside the domain, which reaches from " +
                            place(sides_.lower) + " to " + place(sides_.upper));
  }

 private:
  const Frame& frame_;
  Sides sides_;
  ShapeReport& report_;
};

/// Outlines of masks. Growth is by how much one lies further out at the top of the mask than at its
/// foot.
class OutlineChecks {
 public:
  /// within: what is inside the outline.
  OutlineChecks(const Frame& frame, ShapeReport& report, PlaceChecks& places, Between within)
      : frame_(frame), sides_(frame.sides()), report_(report), places_(places), outline_(within) {}

  void check(const std::string& prefix, const SlotOutline& s, double growth) {
    if (!report_.feature(prefix + "width", s.width, outline_)) return;
    places_.row(prefix, s.along, s.centre, s.width + std::max(2 * growth, 0.0), s.repeat, outline_);
    narrow_end(prefix, s.width + 2 * growth);
  }
  void check(const std::string& prefix, const CircleOutline& s, double growth) {
    if (places_.round_outline(prefix, s.centre, s.radius, s.radius + std::max(growth, 0.0),
                              s.repeat, outline_)) {
      narrow_end(prefix, 2 * (s.radius + growth));
    }
  }
  void check(const std::string& prefix, const RectangleOutline& s, double growth) {
    if (places_.is_lopsided(prefix) || !places_.lattice(prefix, s.repeat)) return;
    bool is_good = true;
    for (int axis = 0; axis < 2; ++axis) {
      if (report_.feature(prefix + "size", s.size[axis], outline_)) {
        places_.interval({prefix + "size", prefix + "center", axis, s.centre[axis],
                          s.size[axis] + std::max(2 * growth, 0.0), s.repeat.count[axis],
                          s.repeat.pitch[axis], outline_});
      } else {
        is_good = false;
      }
    }
    if (is_good) narrow_end(prefix, std::min(s.size[0], s.size[1]) + 2 * growth);
    report_.radius(prefix + "corner_radius", s.corner_radius, 0.5 * std::min(s.size[0], s.size[1]));
  }

  /// The walls must stand on their own at the foot and at the top.
  void check(const std::string& prefix, const PolygonOutline& outline, double growth) {
    const bool is_list = outline.rule == PolygonOutline::Rule::even_odd;
    const std::string key = prefix + (outline.is_section ? "shape" : is_list ? "points" : "file");
    if (places_.is_lopsided(prefix)) return;
    if (frame_.is_section() && !outline.is_section) {
      report_.report(
          prefix + "shape",
          "polygons and layouts need three dimensions, or the line of the cross-section: "
          "domain.cut = \"from X, Y to X, Y\"");
      return;
    }
    if (is_list) {
      if (const auto fault = polygon_fault(outline.loops)) {
        report_.report(key, *fault);
        return;
      }
    }
    if (places_.is_endless(key, outline.loops)) return;
    const std::vector<Loop> foot = domain_loops(frame_, outline, growth);
    // A line may miss an outline, or lie in it altogether.
    if (outline.is_section && (foot.empty() || covers_domain(foot))) return;
    if (foot.empty() && !outline.sizing.is_none()) {
      report_.report(prefix + (outline.sizing.grow < 0 ? "grow" : "corner_radius"),
                     "leaves nothing of the outline in the domain");
    } else if (foot.empty()) {
      places_.report_outside(key);
    } else if (covers_domain(foot)) {
      report_.report(key, prefix == "opening."
                              ? "covers the whole domain and leaves nothing of the mask"
                              : "covers the whole domain; write shape = \"layer\" for that");
    } else if (const auto fault = thin_feature(frame_, foot, report_.narrow())) {
      report_.report_narrow(key, *fault, Between::walls);
    } else if (growth != 0) {
      const std::vector<Loop> top = moved_outwards(foot, growth);
      if (!same_directions(foot, top) || thin_feature(frame_, top, report_.narrow())) {
        report_.report_narrow(
            "taper", "makes the walls of the polygon meet, or nearly, below the top of the mask",
            Between::walls);
      }
    }
  }

 private:
  /// The outline must not close below the top of the mask.
  void narrow_end(const std::string& prefix, double width) {
    if (report_.is_narrow(width)) {
      report_.report_narrow("taper",
                            "leaves " + in_nm(std::max(width, 0.0)) + " of the " +
                                prefix.substr(0, prefix.size() - 1) +
                                " at the top of the mask: less " + report_.than_spacings(),
                            outline_);
    }
  }

  /// Loops that leave something of the domain inside have no edge within it when all of it is.
  bool covers_domain(const std::vector<Loop>& loops) const {
    for (const Loop& loop : loops) {
      for (std::size_t p = 0; p < loop.size(); ++p) {
        const Point2& a = loop[p];
        const Point2& b = loop[(p + 1) % loop.size()];
        bool apart = false;
        for (int axis = 0; axis < 2; ++axis) {
          apart = apart || std::max(a[axis], b[axis]) < sides_.lower[axis] ||
                  std::min(a[axis], b[axis]) > sides_.upper[axis];
        }
        if (!apart) return false;
      }
    }
    return true;
  }

  bool in_domain(const Point2& point) const {
    return point[0] >= sides_.lower[0] && point[0] <= sides_.upper[0] &&
           point[1] >= sides_.lower[1] && point[1] <= sides_.upper[1];
  }

  /// No edge that ends in the domain has shrunk to nothing and turned over.
  bool same_directions(const std::vector<Loop>& before, const std::vector<Loop>& after) const {
    for (std::size_t l = 0; l < before.size(); ++l) {
      for (std::size_t p = 0; p < before[l].size(); ++p) {
        const std::size_t next = (p + 1) % before[l].size();
        if (!in_domain(before[l][p]) && !in_domain(before[l][next])) continue;
        double along = 0;
        for (std::size_t axis = 0; axis < 2; ++axis) {
          along += (before[l][next][axis] - before[l][p][axis]) *
                   (after[l][next][axis] - after[l][p][axis]);
        }
        if (!(along > 0)) return false;
      }
    }
    return true;
  }

  const Frame& frame_;
  Sides sides_;
  ShapeReport& report_;
  PlaceChecks& places_;
  Between outline_;
};

/// What the shapes so far make together: layers, and a height.
class StackLimits {
 public:
  StackLimits(double spacing, ShapeReport& report) : spacing_(spacing), report_(report) {}

  void begin_on(const Ground& ground) {
    layer_count_ = static_cast<double>(ground.materials.size());
    lowest_ = ground.lowest;
    highest_ = ground.highest;
  }

  double lowest() const { return lowest_; }
  double highest() const { return highest_; }

  /// Counts layers that a shape adds.
  void add_layers(const std::string& key, double count) {
    const double before = layer_count_;
    layer_count_ += count;
    if (layer_count_ > most_layers && before <= most_layers) {
      report_.report(key, "makes " + whole_text(layer_count_) +
                              " layers with those below; at most " + std::to_string(most_layers) +
                              " can be told apart");
    }
  }

  /// The stack reaches from the lowest cut to the top of what was added.
  /// Whether all so far is low enough.
  bool reach(const std::string& key, double lowest, double highest) {
    const double limit = most_levels * spacing_;
    const bool was_fine = highest_ - lowest_ <= limit;
    lowest_ = std::min(lowest_, lowest);
    highest_ = std::max(highest_, highest);
    if (was_fine && highest_ - lowest_ > limit) {
      report_.report(key, "makes the geometry " + whole_text((highest_ - lowest_) / spacing_) +
                              " grid spacings high; at most " + whole_text(most_levels) + ": " +
                              in_nm(limit));
    }
    return highest_ - lowest_ <= limit;
  }

 private:
  double spacing_;
  ShapeReport& report_;
  double layer_count_ = 0;
  double lowest_ = 0;
  double highest_ = 0;
};

/// Goes through the shapes from the wafer up, with the stack that they make.
class Checker {
 public:
  /// Units: the least width of a feature in spacings.
  Checker(const Frame& frame, double narrowest)
      : frame_(frame),
        sides_(frame.sides()),
        report_(frame, narrowest),
        places_(frame, report_),
        stack_(frame.spacing, report_) {}

  /// The shapes act on what is there already.
  void begin_on(const Ground& ground) {
    has_ground_ = true;
    stack_.begin_on(ground);
    materials_ = ground.materials;
  }

  std::vector<ShapeProblem> run(std::span<const Shape> shapes) {
    if (shapes.empty() && !has_ground_) {
      report_.report("shape", "there is no shape; the first must be a wafer");
    }
    if (shapes.size() > most_shapes) {
      report_.turn_to(most_shapes);
      report_.report("shape", "is one of " + std::to_string(shapes.size()) + " shapes, at most " +
                                  std::to_string(most_shapes) +
                                  " can be; draw what is alike with repeat, polygons or a layout");
      return report_.take();
    }
    for (std::size_t n = 0; n < shapes.size(); ++n) {
      report_.turn_to(n);
      const bool is_wafer = std::holds_alternative<WaferShape>(shapes[n]);
      if (is_wafer && has_ground_) {
        report_.report("shape", "there is a wafer already; leave this one out");
      } else if (is_wafer != (n == 0) && !has_ground_) {
        report_.report("shape", is_wafer ? "a wafer can only be the first shape"
                                         : "the first shape must be a wafer");
      }
      std::visit([&](const auto& s) { check(s); }, shapes[n]);
    }
    return report_.take();
  }

 private:
  void known(const std::string& key, MaterialId material) {
    if (std::find(materials_.begin(), materials_.end(), material) == materials_.end()) {
      report_.report(key, "this material is not in the stack below");
    }
  }

  /// The narrow end must not close: the floor is at least two spacings wide. What follows from a
  /// width or a depth that is wrong itself is not told.
  void cut(const Cut& cut, double width, bool width_is_good) {
    report_.taper(cut.taper);
    if (cut.depth_from) {
      known("depth_from", *cut.depth_from);
    }
    for (const MaterialId material : cut.through) {
      known("through", material);
    }
    const double floor = width - 2 * cut.depth * std::tan(cut.taper);
    const bool depth_is_good = report_.height("depth", cut.depth);
    stack_.reach("depth", stack_.highest() - cut.depth, stack_.highest());
    if (depth_is_good) report_.radius("top_radius", cut.top_radius, cut.depth);
    if (depth_is_good && width_is_good) {
      if (report_.is_narrow(floor)) {
        report_.report_narrow("taper",
                              "leaves a floor of " + in_nm(std::max(floor, 0.0)) +
                                  " at this depth: less " + report_.than_spacings(),
                              Between::walls);
      } else {
        report_.radius("bottom_radius", cut.bottom_radius, std::min(cut.depth, 0.5 * floor));
      }
    }
    if (cut.top_radius > 0 && has_ground_) {
      report_.report("top_radius", "is known for the first wafer of a flow only; leave it out");
    }
    if (cut.top_radius > 0 && !cut.through.empty()) {
      report_.report("top_radius", "cannot be rounded where only some materials are cut (through)");
    }
  }

  void check(const WaferShape& s) { materials_.push_back(s.material); }

  void check(const LayerShape& s) {
    if (!std::isfinite(s.thickness) || s.thickness <= 0) {
      report_.report("thickness", "must be a length above 0");
    }
    stack_.add_layers("thickness", 1);
    stack_.reach("thickness", stack_.lowest(), stack_.highest() + s.thickness);
    materials_.push_back(s.material);
  }

  void check(const StackShape& s) {
    if (s.layers.empty()) report_.report("materials", "there is no layer");
    if (s.count < 1) report_.report("count", "must be 1 or more");
    for (const LayerShape& layer : s.layers) check(layer);
    // The first of the copies is counted with its layers.
    const double copies = std::max(s.count - 1, 0);
    double thickness = 0;
    for (const LayerShape& layer : s.layers) thickness += layer.thickness;
    stack_.add_layers("count", copies * static_cast<double>(s.layers.size()));
    stack_.reach("count", stack_.lowest(), stack_.highest() + copies * thickness);
  }

  void check(const TrenchShape& s) {
    if (s.is_everywhere) {
      cut(s.cut, 0, false);
      return;
    }
    const bool is_good = report_.feature("width", s.width, Between::walls);
    if (is_good)
      places_.row("", s.along, s.centre, widest(s.width, s.cut), s.repeat, Between::walls);
    cut(s.cut, s.width, is_good);
  }

  void check(const HoleShape& s) {
    const bool is_good = places_.round_outline(
        "", s.centre, s.radius, 0.5 * widest(2 * s.radius, s.cut), s.repeat, Between::walls);
    cut(s.cut, 2 * s.radius, is_good);
  }

  void check(const FinShape& s) {
    report_.taper(s.taper);
    const bool width_is_good = report_.feature("width", s.width, Between::sides);
    if (width_is_good) places_.row("", s.along, s.centre, s.width, s.repeat, Between::sides);
    const double ridge = s.width - 2 * s.height * std::tan(s.taper);
    if (report_.height("height", s.height) && width_is_good && report_.is_narrow(ridge)) {
      report_.report_narrow("taper", "leaves a ridge of less " + report_.than_spacings(),
                            Between::sides);
    }
    stack_.add_layers("material", 1);
    stack_.reach("height", stack_.lowest(), stack_.highest() + s.height);
    materials_.push_back(s.material);
  }

  void check(const MaskShape& s) {
    const bool thickness_is_good = report_.height("thickness", s.thickness);
    const bool has_growth = report_.taper(s.taper) && thickness_is_good;
    stack_.add_layers("material", 1);
    stack_.reach("thickness", stack_.lowest(), stack_.highest() + s.thickness);
    const bool opening = s.outlines == MaskShape::Outlines::opening;
    const double growth = has_growth ? (opening ? 1 : -1) * s.thickness * std::tan(s.taper) : 0;
    const std::string prefix = opening ? "opening." : "resist.";
    OutlineChecks outlines(frame_, report_, places_, opening ? Between::walls : Between::sides);
    std::visit([&](const auto& outline) { outlines.check(prefix, outline, growth); }, s.outline);
    materials_.push_back(s.material);
  }

  void check(const MeshShape& s) {
    if (frame_.is_section()) {
      report_.report("shape",
                     "meshes need three dimensions, or a plane in which they are cut: section = "
                     "\"y = 0 nm\"");
    } else {
      const TriMesh mesh = welded(*s.mesh);
      if (const auto fault = mesh_fault(frame_, mesh)) {
        report_.report("file", *fault);
      } else {
        const Box box = bounding_box(mesh);
        mesh_size(mesh, box);
        stack_.reach("file", box.lower.z, box.upper.z);
      }
    }
    stack_.add_layers("material", s.material ? 1 : 0);
    if (s.material) materials_.push_back(*s.material);
  }

  void check(const ProfileShape& s) {
    if (!frame_.is_slice()) {
      report_.report("shape", "a profile needs mode = \"2d\"");
    } else if (!s.loops.empty()) {
      profile(s);
    }
    stack_.add_layers("material", s.material ? 1 : 0);
    if (s.material) materials_.push_back(*s.material);
  }

  /// The walls of a profile cross nowhere and are far enough from each other.
  void profile(const ProfileShape& s) {
    const auto [lower, upper] = heights_of(s);
    if (!stack_.reach("points", lower, upper)) return;
    const double far = 32 * frame_.spacing;
    const std::vector<Loop> loops = closed_profile(s, s.material ? lower - far : upper + far);
    if (const auto fault = polygon_fault(loops)) {
      report_.report("points", *fault);
      return;
    }
    const Frame plane = profile_frame(frame_, loops);
    const std::vector<Loop> walls = domain_loops(plane, {loops});
    if (walls.empty()) {
      places_.report_outside("points");
    } else if (const auto fault = thin_feature(plane, walls, report_.narrow())) {
      report_.report_narrow("points", *fault, Between::sides);
    }
  }

  /// Something of a mesh is in the domain, and no body of it is lost between the nodes.
  void mesh_size(const TriMesh& mesh, const Box& box) {
    for (int axis = 0; axis < 2; ++axis) {
      if (box.upper[axis] <= sides_.lower[axis] || box.lower[axis] >= sides_.upper[axis]) {
        places_.report_outside("file");
        return;
      }
    }
    if (mesh_border(mesh) > 0) return;
    if (places_.is_endless("file", {box.lower.x, box.lower.y}, {box.upper.x, box.upper.y})) return;
    for (const TriMesh& part : separate_parts(mesh)) {
      const double thick = thickness(part);
      if (report_.is_narrow(thick)) {
        const Box body = bounding_box(part);
        const Vec3d size = body.upper - body.lower;
        report_.report_narrow("file",
                              "has a body around " + place(0.5 * (body.lower + body.upper)) +
                                  " that is " + in_nm(thick) + " thick and " +
                                  in_nm(std::max({size.x, size.y, size.z})) + " long, thinner " +
                                  report_.than_spacings() +
                                  "; choose a smaller spacing, or another unit if that is wrong",
                              Between::sides);
        return;
      }
    }
  }

  const Frame& frame_;
  Sides sides_;
  ShapeReport report_;
  PlaceChecks places_;
  StackLimits stack_;
  std::vector<MaterialId> materials_;
  bool has_ground_ = false;
};

}  // namespace

std::vector<ShapeProblem> check_shapes(const Frame& frame, std::span<const Shape> shapes) {
  return Checker(frame, thinnest).run(shapes);
}

std::vector<ShapeProblem> check_shapes_on(const Frame& frame, std::span<const Shape> shapes,
                                          const Ground& ground) {
  Checker checker(frame, thinnest);
  checker.begin_on(ground);
  return checker.run(shapes);
}

std::vector<ShapeProblem> narrow_features(const Frame& frame, std::span<const Shape> shapes,
                                          double width) {
  return Checker(frame, width / frame.spacing).run(shapes);
}

}  // namespace scarp
