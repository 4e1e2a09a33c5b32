#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/shapes.h"

namespace scarp {

namespace {

/// Features thinner than this many spacings are refused: the band cannot hold both their sides.
constexpr double thinnest = 2;

std::string in_nm(double length) {
  std::string text = std::to_string(length);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') {
    text.pop_back();
  }
  return text + " nm";
}

class Checker {
 public:
  explicit Checker(const Frame& frame) : frame_(frame), sides_(frame.sides()) {}

  std::vector<ShapeProblem> run(std::span<const Shape> shapes) {
    if (shapes.empty()) {
      problems_.push_back({0, "shape", "there is no shape; the first must be a wafer"});
    }
    for (shape_ = 0; shape_ < shapes.size(); ++shape_) {
      const bool is_wafer = std::holds_alternative<WaferShape>(shapes[shape_]);
      if (is_wafer != (shape_ == 0)) {
        report("shape", is_wafer ? "a wafer can only be the first shape"
                                 : "the first shape must be a wafer");
      }
      std::visit([&](const auto& s) { check(s); }, shapes[shape_]);
    }
    return std::move(problems_);
  }

 private:
  void report(std::string key, std::string message) {
    problems_.push_back({shape_, std::move(key), std::move(message)});
  }

  /// A length of at least two spacings.
  bool feature(const std::string& key, double length) {
    const double shortest = thinnest * frame_.spacing;
    if (!std::isfinite(length) || length <= 0) {
      report(key, "must be a length above 0");
    } else if (length < shortest * (1 - 1e-9)) {
      report(key, in_nm(length) + " is thinner than two grid spacings (" + in_nm(shortest) + ")");
    } else {
      return true;
    }
    return false;
  }

  void taper(double angle) {
    if (!(std::abs(angle) < 0.49 * std::numbers::pi)) {
      report("taper", "must lie between -88 deg and 88 deg");
    }
  }

  /// A lateral interval: narrower than the domain, its centre inside, and walls that are not too
  /// thin between it and its image beyond a side.
  void interval(const std::string& key, const std::string& centre_key, int axis, double centre,
                double width) {
    const double extent = sides_.width(axis);
    if (!std::isfinite(centre) || centre < sides_.lower[axis] || centre > sides_.upper[axis]) {
      report(centre_key, "must lie in the domain, between " + in_nm(sides_.lower[axis]) + " and " +
                             in_nm(sides_.upper[axis]));
      return;
    }
    if (width >= extent * (1 - 1e-9)) {
      report(key, in_nm(width) + " is not narrower than the domain (" + in_nm(extent) + ")");
      return;
    }
    const double left = centre - 0.5 * width - sides_.lower[axis];
    const double right = sides_.upper[axis] - centre - 0.5 * width;
    const bool periodic = frame_.boundary[axis] == Boundary::periodic;
    for (const double wall :
         {periodic ? left + right : 2 * left, periodic ? left + right : 2 * right}) {
      if (wall > 0 && wall < thinnest * frame_.spacing * (1 - 1e-9)) {
        report(key, "leaves " + in_nm(wall) +
                        " to its image beyond a side of the domain: less than two grid spacings (" +
                        in_nm(thinnest * frame_.spacing) + ")");
        return;
      }
    }
  }

  int across(const std::string& key, int along) {
    if (frame_.two_dimensional && along != 1) {
      report(key, "must be \"y\" in two dimensions");
    }
    return 1 - along;
  }

  void known(const std::string& key, MaterialId material) {
    if (std::find(materials_.begin(), materials_.end(), material) == materials_.end()) {
      report(key, "this material is not in the stack below");
    }
  }

  /// The narrow end must not close: the floor is at least two spacings wide.
  void cut(const Cut& cut, double width) {
    taper(cut.taper);
    if (cut.depth_from) {
      known("depth_from", *cut.depth_from);
    }
    for (const MaterialId material : cut.through) {
      known("through", material);
    }
    const double floor = width - 2 * cut.depth * std::tan(cut.taper);
    if (feature("depth", cut.depth) && floor < thinnest * frame_.spacing * (1 - 1e-9)) {
      report("taper", "leaves a floor of " + in_nm(std::max(floor, 0.0)) +
                          " at this depth: less than two grid spacings");
    }
  }

  void round_outline(const std::string& prefix, std::array<double, 2> centre, double radius) {
    if (feature(prefix + "radius", 2 * radius)) {
      for (int axis = 0; axis < (frame_.two_dimensional ? 1 : 2); ++axis) {
        interval(prefix + "radius", prefix + "center", axis, centre[axis], 2 * radius);
      }
    }
    if (frame_.two_dimensional) {
      report("shape", "round shapes need three dimensions");
    }
  }

  void check(const WaferShape& s) { materials_.push_back(s.material); }

  void check(const LayerShape& s) {
    if (!std::isfinite(s.thickness) || s.thickness <= 0) {
      report("thickness", "must be a length above 0");
    }
    materials_.push_back(s.material);
  }

  void check(const TrenchShape& s) {
    if (feature("width", s.width)) {
      interval("width", "center", across("along", s.along), s.centre, s.width);
    }
    cut(s.cut, s.width);
  }

  void check(const HoleShape& s) {
    round_outline("", s.centre, s.radius);
    cut(s.cut, 2 * s.radius);
  }

  void check(const FinShape& s) {
    taper(s.taper);
    if (feature("width", s.width)) {
      interval("width", "center", across("along", s.along), s.centre, s.width);
    }
    const double ridge = s.width - 2 * s.height * std::tan(s.taper);
    if (feature("height", s.height) && ridge < thinnest * frame_.spacing * (1 - 1e-9)) {
      report("taper", "leaves a ridge of less than two grid spacings");
    }
    materials_.push_back(s.material);
  }

  void check(const MaskShape& s) {
    feature("thickness", s.thickness);
    taper(s.taper);
    const std::string prefix = s.outlines == MaskShape::Outlines::opening ? "opening." : "resist.";
    std::visit([&](const auto& outline) { check_outline(prefix, outline); }, s.outline);
    materials_.push_back(s.material);
  }

  void check_outline(const std::string& prefix, const SlotOutline& s) {
    if (feature(prefix + "width", s.width)) {
      interval(prefix + "width", prefix + "center", across(prefix + "along", s.along), s.centre,
               s.width);
    }
  }
  void check_outline(const std::string& prefix, const CircleOutline& s) {
    round_outline(prefix, s.centre, s.radius);
  }
  void check_outline(const std::string& prefix, const RectangleOutline& s) {
    for (int axis = 0; axis < 2; ++axis) {
      if (feature(prefix + "size", s.size[axis])) {
        interval(prefix + "size", prefix + "center", axis, s.centre[axis], s.size[axis]);
      }
    }
  }

  const Frame& frame_;
  Sides sides_;
  std::size_t shape_ = 0;
  std::vector<MaterialId> materials_;
  std::vector<ShapeProblem> problems_;
};

}  // namespace

std::vector<ShapeProblem> check_shapes(const Frame& frame, std::span<const Shape> shapes) {
  return Checker(frame).run(shapes);
}

}  // namespace scarp
