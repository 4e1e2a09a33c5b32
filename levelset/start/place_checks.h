#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/frame.h"
#include "levelset/start/polygon.h"
#include "levelset/start/shape_report.h"
#include "levelset/start/shapes.h"

namespace scarp {

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
  void interval(const Interval& s);

  /// Counts and pitches that make sense.
  bool lattice(const std::string& prefix, const Repeat& repeat);

  /// Whether a shape that is not round meets a frame that goes around an axis.
  bool is_lopsided(const std::string& prefix);

  /// A slot, trench or fin: one interval across.
  void row(const std::string& prefix, int along, double centre, double widest, const Repeat& repeat,
           Between between);

  /// Whether the radius is good.
  bool round_outline(const std::string& prefix, const std::array<double, 2>& centre, double radius,
                     double widest_radius, const Repeat& repeat, Between between);

  /// So long that its copies beyond periodic sides could not be counted.
  bool is_endless(const std::string& key, Point2 lower, Point2 upper);

  bool is_endless(const std::string& key, const std::vector<Loop>& loops);

  void report_outside(const std::string& key);

 private:
  const Frame& frame_;
  Sides sides_;
  ShapeReport& report_;
};

}  // namespace scarp
