#include "levelset/start/place_checks.h"

#include <algorithm>
#include <cmath>

#include "core/recipe/quantity.h"

namespace scarp {

void PlaceChecks::interval(const Interval& s) {
  const Between others = s.between == Between::walls ? Between::sides : Between::walls;
  const double extent = sides_.width(s.axis);
  const double half_row = 0.5 * (s.count - 1) * s.pitch;
  const double slack = 1e-9 * extent;
  if (!(s.centre - half_row >= sides_.lower[s.axis] - slack &&
        s.centre + half_row <= sides_.upper[s.axis] + slack)) {
    const std::string allowed = in_nm(sides_.lower[s.axis]) + " and " + in_nm(sides_.upper[s.axis]);
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

bool PlaceChecks::lattice(const std::string& prefix, const Repeat& repeat) {
  for (int axis = 0; axis < 2; ++axis) {
    if (repeat.count[axis] < 1) {
      report_.report(prefix + "repeat", "must be 1 or more");
      return false;
    }
    if (repeat.count[axis] > 1 && !(std::isfinite(repeat.pitch[axis]) && repeat.pitch[axis] > 0)) {
      report_.report(prefix + "pitch", "must be a length above 0");
      return false;
    }
  }
  return true;
}

bool PlaceChecks::is_lopsided(const std::string& prefix) {
  if (frame_.is_around_axis())
    report_.report(prefix + "shape", "is not the same all around the axis; use a round shape");
  return frame_.is_around_axis();
}

void PlaceChecks::row(const std::string& prefix, int along, double centre, double widest,
                      const Repeat& repeat, Between between) {
  if (is_lopsided(prefix)) return;
  if (!frame_.varies_along(1 - along)) {
    report_.report(prefix + "along", "must be \"y\" in two dimensions");
  } else if (lattice(prefix, repeat)) {
    const int axis = 1 - along;
    interval({prefix + "width", prefix + "center", axis, centre, widest, repeat.count[axis],
              repeat.pitch[axis], between});
  }
}

bool PlaceChecks::round_outline(const std::string& prefix, const std::array<double, 2>& centre,
                                double radius, double widest_radius, const Repeat& repeat,
                                Between between) {
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

bool PlaceChecks::is_endless(const std::string& key, Point2 lower, Point2 upper) {
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

bool PlaceChecks::is_endless(const std::string& key, const std::vector<Loop>& loops) {
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

void PlaceChecks::report_outside(const std::string& key) {
  report_.report(key, "lies wholly outside the domain, which reaches from " +
                          place_text(sides_.lower) + " to " + place_text(sides_.upper));
}

}  // namespace scarp
