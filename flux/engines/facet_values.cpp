#include "flux/engines/facet_values.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <span>

#include "core/parallel.h"
#include "core/smooth_edge.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 256;  // elements

// What speaks for no slope, where a neighbour as large as the element counts 1: along rows of
// neighbours there is none across, and slivers with few rays, close by as they are, make none.
constexpr double ridge = 0.03;

constexpr double least_square = 1e-6;  // of a distance in spacings

// Of what neighbours tell in a direction, where one as large as the element right there tells 1.
constexpr double least_width = 0.3;

// Numbers of places, the same for the same place to the last bit. Vertices of pieces are exact sums
// of vertices of the mesh, so that those of neighbours are the same.
class Places {
 public:
  explicit Places(std::size_t most)
      : slots_(std::bit_ceil(2 * most + 1), none), mask_(slots_.size() - 1) {}

  std::uint32_t number(Vec3d r) {
    for (std::size_t slot = hash(r);; ++slot) {
      std::uint32_t& number = slots_[slot & mask_];
      if (number == none) {
        number = static_cast<std::uint32_t>(places_.size());
        places_.push_back(r);
      }
      if (places_[number] == r) return number;
    }
  }
  std::size_t count() const { return places_.size(); }

 private:
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  // Adding zero makes one zero of both.
  static std::size_t hash(Vec3d r) {
    std::uint64_t bits = 0;
    for (const double x : {r.x, r.y, r.z}) {
      bits = (bits ^ std::bit_cast<std::uint64_t>(x + 0.0)) * 0x9E3779B97F4A7C15U;
      bits ^= bits >> 32;
    }
    return bits;
  }

  std::vector<std::uint32_t> slots_;
  std::size_t mask_;
  std::vector<Vec3d> places_;
};

}  // namespace

// Which elements touch, and the slope of a plane through an element's number that fits those of its
// neighbours best, each counted by its area over its distance squared.
class FacetValues::Neighbours {
 public:
  Neighbours(const TriMesh& mesh, const Elements& elements);

  struct Around {
    bool is_strip = false;
    Vec3f one_side{};
  };
  /// Adds the neighbours of an element, which are found in their order; returns how they lie around
  /// it.
  Around fit(std::uint32_t element, std::vector<Neighbour>& neighbours) const;

 private:
  std::vector<std::uint32_t> of(std::uint32_t element) const;
  // To the nearest image. Nothing changes across a section.
  Vec3d away(std::uint32_t element, std::uint32_t other) const {
    const RayScene& scene = elements_.scene();
    Vec3d d = elements_.middle(other) - elements_.middle(element);
    for (int axis = 0; axis < 2; ++axis) {
      const double width = scene.upper()[axis];
      if (!scene.is_periodic(axis)) continue;
      if (d[axis] > width / 2) d[axis] -= width;
      if (d[axis] < -width / 2) d[axis] += width;
    }
    if (elements_.are_of_section()) d.y = 0;
    return d;
  }
  // Upper and lower sides of a period are one.
  Vec3d wrapped(Vec3d r) const {
    const RayScene& scene = elements_.scene();
    for (int axis = 0; axis < 2; ++axis)
      if (scene.is_periodic(axis) && r[axis] == scene.upper()[axis]) r[axis] = 0;
    return r;
  }
  bool are_smooth(const Elements::Piece& a, const Elements::Piece& b) const {
    const auto& materials = mesh_.materials;
    return (materials.empty() || materials[a.facet] == materials[b.facet]) &&
           dot(a.normal, b.normal) > smooth_cosine;
  }

  const TriMesh& mesh_;
  const Elements& elements_;
  std::vector<std::array<std::uint32_t, 3>> places_;  // per piece: of its corners
  std::vector<std::uint32_t> first_;                  // per place
  std::vector<std::uint32_t> pieces_;                 // around each
};

FacetValues::Neighbours::Neighbours(const TriMesh& mesh, const Elements& elements)
    : mesh_(mesh), elements_(elements), places_(elements.piece_count()) {
  Places places(3 * places_.size());
  for (std::size_t p = 0; p < places_.size(); ++p)
    for (std::size_t corner = 0; corner < 3; ++corner)
      places_[p][corner] = places.number(wrapped(elements.piece(p).corners[corner]));
  first_.resize(places.count() + 1);
  for (const auto& of_piece : places_)
    for (const std::uint32_t place : of_piece) ++first_[place + 1];
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  pieces_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t p = 0; p < places_.size(); ++p)
    for (const std::uint32_t place : places_[p]) pieces_[next[place]++] = p;
}

std::vector<std::uint32_t> FacetValues::Neighbours::of(std::uint32_t element) const {
  std::vector<std::uint32_t> found;
  for (const std::uint32_t p : elements_.pieces_of(element)) {
    for (const std::uint32_t place : places_[p]) {
      for (std::uint32_t k = first_[place]; k < first_[place + 1]; ++k) {
        const std::uint32_t other = elements_.element_of(pieces_[k]);
        if (other != element && are_smooth(elements_.piece(p), elements_.piece(pieces_[k])) &&
            std::ranges::find(found, other) == found.end())
          found.push_back(other);
      }
    }
  }
  // One around the other tells no slope.
  std::erase_if(found, [&](std::uint32_t other) {
    const Vec3d d = away(element, other);
    return dot(d, d) < least_square;
  });
  std::ranges::sort(found);
  return found;
}

// A value that bends as much in all directions makes a slope wrong along the sum of slopes times
// squared distances.
FacetValues::Neighbours::Around FacetValues::Neighbours::fit(
    std::uint32_t element, std::vector<Neighbour>& neighbours) const {
  const std::vector<std::uint32_t> found = of(element);
  Eigen::Matrix3d squares = ridge * Eigen::Matrix3d::Identity();  // of the normal equations
  std::vector<Eigen::Vector3d> weighted;
  for (const std::uint32_t neighbour : found) {
    const Vec3d between = away(element, neighbour);
    const Eigen::Vector3d d(between.x, between.y, between.z);
    const double weight = std::min(1.0, elements_.area(neighbour) / elements_.area(element));
    weighted.emplace_back(weight / d.squaredNorm() * d);
    squares += weighted.back() * d.transpose();
  }
  const Eigen::LLT<Eigen::Matrix3d> fit(squares);
  Vec3d by_bend;
  double distances = 0;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const Eigen::Vector3d slope = fit.solve(weighted[k]);
    const Vec3d d = away(element, found[k]);
    by_bend += dot(d, d) * Vec3d{slope.x(), slope.y(), slope.z()};
    distances += length(d);
    neighbours.push_back(
        {found[k], Vec3f(Vec3d{slope.x(), slope.y(), slope.z()}), Vec3f(away(element, found[k]))});
  }
  // The smallest one is that along the normal.
  const Eigen::Vector3d widths =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(squares, Eigen::EigenvaluesOnly).eigenvalues();
  const double most = distances > 0 ? static_cast<double>(found.size()) / distances : 0;
  // Where the surface bends all neighbours lie on one side of it, too.
  const Vec3d n = normalized(elements_.normal(element));
  const Vec3d one_side = most * (by_bend - dot(by_bend, n) * n);
  return {.is_strip = widths[1] <= least_width,
          .one_side = Vec3f(one_side / std::max(1.0, length(one_side)))};
}

FacetValues::FacetValues(const TriMesh& mesh, const Elements& elements)
    : first_(elements.count() + 1), is_strip_(elements.count()), one_side_(elements.count()) {
  // A floor between walls may be one element across: its flux was seen to have an error of 8 % in
  // places where elements of eight spacings cover a floor of twenty.
  constexpr float of_widest = 0.02F;
  for (std::size_t f = 0; f < elements.scene().facet_count(); ++f) {
    const float width = elements.cell_width(f) / widest_cell;
    off_in_strip_.push_back(of_widest * width * width);
  }
  find_parts(elements);
  if (!elements.are_rings()) find_planes(mesh, elements);
}

double FacetValues::off_in_strips(std::size_t facet) const {
  double share = 0;
  for (const Part& part : parts_of(facet))
    if (is_strip_[part.element] != 0) share += static_cast<double>(part.share);
  return share * static_cast<double>(off_in_strip_[facet]);
}

// Pieces of a facet that are in the same element follow each other, or nearly.
void FacetValues::find_parts(const Elements& elements) {
  const std::size_t facet_count = elements.scene().facet_count();
  first_part_.reserve(facet_count + 1);
  parts_.reserve(facet_count);
  first_part_.push_back(0);
  for (std::size_t f = 0; f < facet_count; ++f) {
    const std::size_t first = parts_.size();
    for (const std::uint32_t p : elements.pieces_of_facet(f)) {
      const std::uint32_t element = elements.element_of(p);
      const double share = elements.share_of_facet(p);
      const Vec3d offset =
          share * (middle_of(elements.piece(p).corners) - elements.middle(element));
      const auto begin = parts_.begin() + static_cast<std::ptrdiff_t>(first);
      const auto part = std::find_if(begin, parts_.end(),
                                     [&](const Part& each) { return each.element == element; });
      if (part == parts_.end()) {
        parts_.push_back({element, static_cast<float>(share), Vec3f(offset)});
      } else {
        part->share += static_cast<float>(share);
        part->offset += Vec3f(offset);
      }
    }
    first_part_.push_back(parts_.size());
  }
}

void FacetValues::find_planes(const TriMesh& mesh, const Elements& elements) {
  const Neighbours touching(mesh, elements);
  std::vector<std::vector<Neighbour>> of_range((elements.count() + grain - 1) / grain);
  parallel_for(elements.count(), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<Neighbour>& neighbours = of_range[begin / grain];
    for (std::size_t e = begin; e < end; ++e) {
      const std::size_t earlier = neighbours.size();
      const auto [is_strip, one_side] = touching.fit(static_cast<std::uint32_t>(e), neighbours);
      is_strip_[e] = is_strip ? 1 : 0;
      one_side_[e] = one_side;
      first_[e + 1] = neighbours.size() - earlier;
    }
  });
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  neighbours_.reserve(first_.back());
  for (const auto& neighbours : of_range)
    neighbours_.insert(neighbours_.end(), neighbours.begin(), neighbours.end());
}

}  // namespace scarp
