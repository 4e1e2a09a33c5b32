#include "flux/revolution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/recipe/quantity.h"
#include "flux/sampling/portable_math.h"

namespace scarp {

namespace {

// A quarter of a polygon of 96 sides has .07 % less area than that of the circle about it.
constexpr std::uint32_t slices = 24;

// Of the width of the strip, which is the spacing.
constexpr double most_apart = 0.01;
// What is nearer to the axis is on it: a needle a thousandth of a spacing wide, as phi leaves
// behind that is kept off zero, is too thin for rays to start from.
constexpr double on_axis = 2e-3;

std::string text(Vec3f r) { return rounded_place(Vec3d(r)); }

// Where a vertex is seen along y: its radius and height.
using Place = std::pair<float, float>;

// The vertices of a section, both ends of an edge along y in one place.
class SectionPlaces {
 public:
  explicit SectionPlaces(const TriMesh& section) : section_(section) { find_places(); }

  std::array<Place, 3> of(std::uint32_t facet) const {
    const Triangle& t = section_.triangles[facet];
    for (const std::uint32_t v : t) {
      if (!(section_.vertices[v].x >= 0))
        throw InputError("flux: a section that is revolved reaches beyond the axis at " +
                         text(section_.vertices[v]));
    }
    return {places_[t[0]], places_[t[1]], places_[t[2]]};
  }

 private:
  // Both ends of an edge along y are one place; rounding may have moved them apart.
  void find_places() {
    Box box;
    for (const Vec3f& r : section_.vertices) {
      places_.emplace_back(r.x, r.z);
      box.add(Vec3d(r));
    }
    std::vector<double> nearest(places_.size(), most_apart * (box.upper.y - box.lower.y));
    for (const Triangle& t : section_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::array ends{t[k], t[(k + 1) % 3]};
        for (std::size_t end = 0; end < 2; ++end) {
          const std::uint32_t here = ends[end];
          const std::uint32_t there = ends[1 - end];
          const Vec3f a = section_.vertices[here];
          const Vec3f b = section_.vertices[there];
          if (a.y != box.lower.y || b.y != box.upper.y) continue;
          const double across = static_cast<double>(a.x) - b.x;
          const double up = static_cast<double>(a.z) - b.z;
          const double apart = std::sqrt(across * across + up * up);
          if (apart >= nearest[there]) continue;
          nearest[there] = apart;
          places_[there] = {a.x, a.z};
        }
      }
    }
    for (Place& place : places_)
      if (place.first < on_axis * (box.upper.y - box.lower.y)) place.first = 0;
  }

  const TriMesh& section_;
  std::vector<Place> places_;
};

}  // namespace

class Revolution::Builder {
 public:
  Builder(const TriMesh& section, double radius, Revolution& result)
      : section_(section), places_(section), radius_(static_cast<float>(radius)), result_(result) {
    // Mirror images about the diagonal to the last bit, and both ends on the mirrors.
    static_assert(slices % 2 == 0);
    for (std::uint32_t k = 0; 2 * k <= slices; ++k) {
      const auto [sine, cosine] = portable_sine_cosine(0.5 * std::numbers::pi * k / slices);
      around_[k] = {cosine, sine};
      around_[slices - k] = {sine, cosine};
    }
  }

  void build() {
    result_.first_facets_.resize(section_.triangles.size());
    std::vector<std::pair<std::uint32_t, Line>> lines;
    std::vector<std::uint32_t> caps;
    for (std::uint32_t f = 0; f < section_.triangles.size(); ++f) {
      const auto [a, b, c] = places_.of(f);
      if (a == b) {
        lines.push_back({f, {a, c}});
      } else if (b == c) {
        lines.push_back({f, {b, a}});
      } else if (c == a) {
        lines.push_back({f, {c, b}});
      } else {
        caps.push_back(f);
      }
    }
    // Of two facets at the axis the one with an edge on it has no area: the ring is the other's.
    std::stable_partition(lines.begin(), lines.end(),
                          [](const auto& each) { return each.second.first.first != 0; });
    for (const auto& [f, line] : lines) seen_as_.try_emplace(line, f);
    for (const auto& [f, line] : lines) add(f, line);
    for (const auto& [f, line] : lines)
      if (lies_on_axis(line)) result_.first_facets_[f] = next_to(line);
    for (const std::uint32_t f : caps) find_ring(f);
    for (const Rim& rim : rims_) fill_corner(rim);
  }

 private:
  // A place on the section; its circle's vertices follow each other.
  struct Point {
    float radius;
    float height;
    std::uint32_t first;
    std::uint32_t vertex(std::uint32_t k) const { return radius == 0 ? first : first + k; }
  };
  // Where the outermost ring ends.
  struct Rim {
    Point at;
    bool faces_up;
    std::uint32_t section_facet;
  };
  // What a facet is seen as along y: from the place of two of its corners to that of the third.
  using Line = std::pair<Place, Place>;

  Point point_at(Place place) {
    const auto [found, is_new] =
        points_.try_emplace(place, static_cast<std::uint32_t>(result_.mesh_.vertices.size()));
    const auto [radius, height] = place;
    if (is_new) {
      for (std::uint32_t k = 0; k <= (radius == 0 ? 0 : slices); ++k)
        result_.mesh_.vertices.push_back({static_cast<float>(radius * around_[k][0]),
                                          static_cast<float>(radius * around_[k][1]), height});
    }
    return {radius, height, found->second};
  }

  void add(std::uint32_t facet, const Line& line) {
    if (lies_on_axis(line)) return;
    auto [from, to] = line;
    const auto [found, is_new] =
        rings_.try_emplace(line, static_cast<std::uint32_t>(result_.mesh_.triangles.size()));
    result_.first_facets_[facet] = found->second;
    if (!is_new) return;
    const bool is_whole = !is_half(facet, line);
    if (is_whole) rings_.emplace(Line{line.second, line.first}, found->second);
    const Vec3d normal = area_vector(section_, facet);
    // The normal is to the left of the way.
    const double along = to.first - from.first;
    const double up = to.second - from.second;
    if (along * normal.z - up * normal.x < 0) std::swap(from, to);
    revolve(point_at(from), point_at(to), facet,
            {.at_from = is_whole || from == line.first, .at_to = is_whole || to == line.first});
    for (const Place& end : {from, to})
      if (end.first == radius_ && (is_whole || end == line.first))
        rims_.push_back({point_at(end), normal.z >= 0, facet});
  }

  static bool lies_on_axis(const Line& line) {
    return line.first.first == 0 && line.second.first == 0;
  }

  // What lies on the axis has no area: it gets what arrives at the nearest ring.
  std::uint32_t next_to(const Line& line) const {
    const double height = 0.5 * (static_cast<double>(line.first.second) + line.second.second);
    double nearest = std::numeric_limits<double>::infinity();
    std::uint32_t ring = 0;
    for (const auto& [place, its] : rings_at_) {
      const double radius = place.first;
      const double up = place.second - height;
      const double apart = radius * radius + up * up;
      if (apart >= nearest) continue;
      nearest = apart;
      ring = its;
    }
    return ring;
  }

  // Two facets of a strip make a ring; where they are of two materials, a ring each.
  bool is_half(std::uint32_t facet, const Line& line) const {
    if (section_.materials.empty() || line.first.first == 0 || line.second.first == 0) return false;
    const auto other = seen_as_.find({line.second, line.first});
    return other != seen_as_.end() &&
           section_.materials[other->second] != section_.materials[facet];
  }

  // An edge in the middle of the strip has a facet on either side that leads from one end of the
  // way over it to the other; it takes part in none of the rings.
  void find_ring(std::uint32_t facet) {
    const auto places = places_.of(facet);
    for (std::size_t k = 0; k < 3; ++k) {
      auto found = rings_.find({places[k], places[(k + 1) % 3]});
      if (found == rings_.end()) found = rings_.find({places[(k + 1) % 3], places[k]});
      if (found == rings_.end()) continue;
      result_.first_facets_[facet] = found->second;
      return;
    }
    throw InputError("flux: a section that is revolved is not the same all along y at " +
                     text(section_.vertices[section_.triangles[facet][0]]));
  }

  // Which of the two facets of each slice: with an edge at this end.
  struct Halves {
    bool at_from;
    bool at_to;
  };

  void revolve(const Point& from, const Point& to, std::uint32_t facet, const Halves& halves) {
    const auto first = static_cast<std::uint32_t>(result_.mesh_.triangles.size());
    for (const Point& end : {from, to}) rings_at_.try_emplace({end.radius, end.height}, first);
    for (std::uint32_t k = 0; k < slices; ++k) {
      if (halves.at_to && to.radius != 0)
        add_facet({from.vertex(k), to.vertex(k), to.vertex(k + 1)}, facet);
      if (halves.at_from && from.radius != 0)
        add_facet({from.vertex(k), to.vertex(k + 1), from.vertex(k + 1)}, facet);
    }
    ++ring_;
  }

  void fill_corner(const Rim& rim) {
    const auto corner = static_cast<std::uint32_t>(result_.mesh_.vertices.size());
    result_.mesh_.vertices.push_back({radius_, radius_, rim.at.height});
    for (std::uint32_t k = 0; k < slices; ++k) {
      Triangle triangle{rim.at.vertex(k), corner, rim.at.vertex(k + 1)};
      if (!rim.faces_up) std::swap(triangle[0], triangle[1]);
      add_facet(triangle, rim.section_facet);
    }
    ++ring_;
  }

  void add_facet(const Triangle& triangle, std::uint32_t section_facet) {
    result_.mesh_.triangles.push_back(triangle);
    if (!section_.materials.empty())
      result_.mesh_.materials.push_back(section_.materials[section_facet]);
    result_.section_facets_.push_back(section_facet);
    result_.rings_.push_back(ring_);
  }

  const TriMesh& section_;
  SectionPlaces places_;
  float radius_;
  Revolution& result_;
  std::array<std::array<double, 2>, slices + 1> around_{};
  std::map<Place, std::uint32_t> points_;    // and the first vertex of their circles
  std::map<Line, std::uint32_t> seen_as_;    // facets of the section
  std::map<Line, std::uint32_t> rings_;      // and their first facets
  std::map<Place, std::uint32_t> rings_at_;  // that of one of the rings that end there
  std::vector<Rim> rims_;
  std::uint32_t ring_ = 0;
};

Revolution::Revolution(const TriMesh& section, const Sides& sides) : radius_(sides.upper[0]) {
  Builder(section, radius_, *this).build();
}

Sides Revolution::sides() const { return {.lower = {0, 0}, .upper = {radius_, radius_}}; }

std::vector<float> Revolution::revolved(std::span<const float> of_section) const {
  std::vector<float> values;
  values.reserve(section_facets_.size());
  for (const std::uint32_t facet : section_facets_) values.push_back(of_section[facet]);
  return values;
}

std::vector<float> Revolution::on_section(std::span<const float> of_rings) const {
  std::vector<float> values;
  values.reserve(first_facets_.size());
  for (const std::uint32_t facet : first_facets_) values.push_back(of_rings[facet]);
  return values;
}

namespace {

// What is given on facets of a section, revolved, and back. What is not given of some is not.
std::vector<std::vector<float>> revolved(const Revolution& revolution,
                                         std::span<const std::vector<float>> of_section) {
  std::vector<std::vector<float>> values;
  for (const std::vector<float>& each : of_section)
    values.push_back(each.empty() ? each : revolution.revolved(each));
  return values;
}

template <class Arrays>
std::vector<std::vector<float>> on_section(const Revolution& revolution, const Arrays& of_rings) {
  std::vector<std::vector<float>> values;
  for (const auto& each : of_rings) values.push_back(revolution.on_section(each));
  return values;
}

std::vector<std::span<const float>> views(const std::vector<std::vector<float>>& arrays) {
  return {arrays.begin(), arrays.end()};
}

void refuse_lopsided(const Species& species) {
  const SourceLobe& source = species.source;
  if (source.kind == SourceLobe::Kind::none) return;
  if ((!source.is_upright() && !source.rotating) || !source.map.empty())
    throw InputError("species " + species.name +
                     ": a tilted or uneven source is not the same all around an axis");
}

StickingFeedback revolved(const Revolution& revolution, const StickingFeedback& feedback) {
  StickingFeedback result = feedback;
  if (!feedback.update) return result;
  result.update = [&](std::span<const std::span<const float>> flux,
                      std::vector<std::vector<float>>& sticking) {
    const std::vector<std::vector<float>> arrivals = on_section(revolution, flux);
    std::vector<std::vector<float>> of_section = on_section(revolution, sticking);
    if (!feedback.update(views(arrivals), of_section)) return false;
    // Where they are: problems refer to them.
    for (std::size_t k = 0; k < sticking.size(); ++k)
      std::ranges::copy(revolution.revolved(of_section[k]), sticking[k].begin());
    return true;
  };
  if (!feedback.sticking_at) return result;
  result.sticking_at = [&](std::span<const std::span<const float>> flux) {
    return revolved(revolution, feedback.sticking_at(views(on_section(revolution, flux))));
  };
  return result;
}

SurfaceEmission revolved(const Revolution& revolution, const SurfaceEmission& emission) {
  SurfaceEmission result = emission;
  if (!emission.of) return result;
  result.of = [&](std::span<const std::span<const float>> flux) {
    const std::vector<std::vector<float>> arrivals = on_section(revolution, flux);
    return revolved(revolution, emission.of(views(arrivals)));
  };
  return result;
}

}  // namespace

std::vector<FluxField> solve_revolved(const TriMesh& section, std::span<const Species> species,
                                      const FluxOptions& options, const StickingFeedback& feedback,
                                      const SurfaceEmission& emission, KeptHits* hits) {
  const Revolution revolution(section, options.sides);
  std::vector<Species> around(species.begin(), species.end());
  for (Species& each : around) {
    refuse_lopsided(each);
    if (!each.emission.empty()) each.emission = revolution.revolved(each.emission);
  }
  FluxOptions of_quarter = options.revolved(revolution.sides(), revolution.rings());
  for (std::vector<std::vector<float>>& of_species : of_quarter.responses)
    of_species = revolved(revolution, of_species);
  std::vector<FluxField> fields =
      solve_flux(revolution.mesh(), around, of_quarter, revolved(revolution, feedback),
                 revolved(revolution, emission), hits);
  for (FluxField& field : fields) {
    for (Tally& tally : field.tallies) {
      tally.mean = revolution.on_section(tally.mean);
      tally.std_error = revolution.on_section(tally.std_error);
    }
  }
  return fields;
}

}  // namespace scarp
