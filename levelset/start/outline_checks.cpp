#include "levelset/start/outline_checks.h"

#include <algorithm>
#include <optional>

#include "levelset/start/covered_axis.h"
#include "levelset/start/polygon_walls.h"

namespace scarp {

void OutlineChecks::check(const std::string& prefix, const SlotOutline& s, double growth) {
  if (!report_.feature(prefix + "width", s.width, outline_)) return;
  places_.row(prefix, s.along, s.centre, s.width + std::max(2 * growth, 0.0), s.repeat, outline_);
  narrow_end(prefix, s.width + 2 * growth);
}

void OutlineChecks::check(const std::string& prefix, const CircleOutline& s, double growth) {
  if (places_.round_outline(prefix, s.centre, s.radius, s.radius + std::max(growth, 0.0), s.repeat,
                            outline_)) {
    narrow_end(prefix, 2 * (s.radius + growth));
  }
}

void OutlineChecks::check(const std::string& prefix, const RectangleOutline& s, double growth) {
  if (places_.is_lopsided(prefix) || !places_.lattice(prefix, s.repeat)) return;
  const std::optional<int> along = covered_axis(frame_, s, growth);
  const auto covers = [&](int axis) { return reach_beyond_sides(frame_, s, axis, 0) >= 0; };
  if (along && covers(0) && covers(1)) {
    report_.report(prefix + "size",
                   prefix == "opening."
                       ? "covers the whole domain and leaves nothing of the mask"
                       : "covers the whole domain; write shape = \"layer\" for that");
    return;
  }
  bool is_good = true;
  for (int axis = 0; axis < 2; ++axis) {
    if (axis == along) continue;
    if (report_.feature(prefix + "size", s.size[axis], outline_)) {
      if (!reaches_sides(prefix, s, axis, growth)) continue;
      places_.interval({prefix + "size", prefix + "center", axis, s.centre[axis],
                        s.size[axis] + std::max(2 * growth, 0.0), s.repeat.count[axis],
                        s.repeat.pitch[axis], outline_});
    } else {
      is_good = false;
    }
  }
  const double width = along ? s.size[1 - *along] : std::min(s.size[0], s.size[1]);
  if (is_good) narrow_end(prefix, width + 2 * growth);
  report_.radius(prefix + "corner_radius", s.corner_radius, 0.5 * std::min(s.size[0], s.size[1]));
}

bool OutlineChecks::reaches_sides(const std::string& prefix, const RectangleOutline& s, int axis,
                                  double growth) {
  const double reach = reach_beyond_sides(frame_, s, axis, growth);
  RectangleOutline foot = s;
  foot.corner_radius = 0;
  if (s.repeat.count[axis] > 1 || reach >= 0 || reach_beyond_sides(frame_, foot, axis, 0) < 0)
    return true;
  report_.report(prefix + "size",
                 in_nm(s.size[axis]) + " reaches from side to side of the domain, but not its " +
                     (s.corner_radius > 0 ? "corners" : "tapered ends") + "; write " +
                     in_nm(s.size[axis] - 2 * reach) + " or more, or shape = \"trench\"");
  return false;
}

void OutlineChecks::check(const std::string& prefix, const PolygonOutline& outline, double growth) {
  const bool is_list = outline.rule == PolygonOutline::Rule::even_odd;
  const std::string key = prefix + (outline.is_section ? "shape" : is_list ? "points" : "file");
  if (places_.is_lopsided(prefix)) return;
  if (frame_.is_section() && !outline.is_section) {
    report_.report(prefix + "shape",
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
  if (foot.empty()) {
    nothing_left(prefix, key, outline, growth);
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

void OutlineChecks::narrow_end(const std::string& prefix, double width) {
  if (report_.is_narrow(width)) {
    report_.report_narrow("taper",
                          "leaves " + in_nm(std::max(width, 0.0)) + " of the " +
                              prefix.substr(0, prefix.size() - 1) +
                              " at the top of the mask: less " + report_.than_spacings(),
                          outline_);
  }
}

void OutlineChecks::nothing_left(const std::string& prefix, const std::string& key,
                                 PolygonOutline outline, double growth) {
  const auto is_there = [&] { return !domain_loops(frame_, outline, growth).empty(); };
  outline.sizing.corner_radius = 0;
  const bool is_rounded_off = is_there();
  outline.sizing = {};
  if (!is_rounded_off && !is_there()) {
    places_.report_outside(key);
    return;
  }
  report_.report(prefix + (is_rounded_off ? "corner_radius" : "grow"),
                 "leaves nothing of the outline in the domain");
}

bool OutlineChecks::covers_domain(const std::vector<Loop>& loops) const {
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

bool OutlineChecks::in_domain(const Point2& point) const {
  return point[0] >= sides_.lower[0] && point[0] <= sides_.upper[0] &&
         point[1] >= sides_.lower[1] && point[1] <= sides_.upper[1];
}

bool OutlineChecks::same_directions(const std::vector<Loop>& before,
                                    const std::vector<Loop>& after) const {
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

}  // namespace scarp
