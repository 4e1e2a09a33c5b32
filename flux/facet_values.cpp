#include "flux/facet_values.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>

#include "core/parallel.h"
#include "flux/reconstruct.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 256;  // elements

// What speaks for no slope, where a neighbour as large as the element counts 1: along rows of
// neighbours there is none across, and slivers with few rays, close by as they are, make none.
constexpr double ridge = 0.03;

}  // namespace

// The slope of a plane through an element's value that fits those of its neighbours best, each
// counted by its area over its distance squared.
class FacetValues::SlopeFit {
 public:
  SlopeFit(const Elements& elements, std::span<const Vec3d> middles, const SmoothCorners& corners)
      : elements_(elements), middles_(middles), corners_(corners) {}

  /// Adds the neighbours of an element.
  void fit(std::uint32_t element, std::vector<Neighbour>& neighbours);

 private:
  void find_neighbours(std::uint32_t element);

  const Elements& elements_;
  std::span<const Vec3d> middles_;  // of elements
  const SmoothCorners& corners_;
  std::vector<std::uint32_t> found_;
  std::vector<Vec3d> slopes_;
};

// Pieces of facets that are cut may lie far away.
void FacetValues::SlopeFit::find_neighbours(std::uint32_t element) {
  found_.clear();
  for (const std::uint32_t p : elements_.pieces_of(element)) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t set = corners_.sets_of(elements_.piece(p).facet)[corner];
      for (const SmoothCorners::Member& each : corners_.members(set)) {
        const Elements::Pieces pieces = elements_.pieces_of_facet(each.facet);
        const std::uint32_t other = elements_.element_of(pieces.front());
        if (pieces.size() == 1 && other != element &&
            std::ranges::find(found_, other) == found_.end())
          found_.push_back(other);
      }
    }
  }
}

void FacetValues::SlopeFit::fit(std::uint32_t element, std::vector<Neighbour>& neighbours) {
  find_neighbours(element);
  slopes_.clear();
  std::array<Vec3d, 3> squares{};  // the normal equations
  for (const std::uint32_t neighbour : found_) {
    const Vec3d d = middles_[neighbour] - middles_[element];
    const double weight = std::min(1.0, elements_.area(neighbour) / elements_.area(element));
    slopes_.push_back(weight / dot(d, d) * d);
    for (int axis = 0; axis < 3; ++axis)
      squares[static_cast<std::size_t>(axis)] += slopes_.back()[axis] * d;
  }
  for (int axis = 0; axis < 3; ++axis) squares[static_cast<std::size_t>(axis)][axis] += ridge;
  const auto& [a, b, c] = squares;
  const Vec3d bc = cross(b, c);
  const Vec3d ca = cross(c, a);
  const Vec3d ab = cross(a, b);
  const double determinant = dot(a, bc);
  for (std::size_t k = 0; k < found_.size(); ++k) {
    const Vec3d sum = slopes_[k];
    const Vec3d slope = (sum.x * bc + sum.y * ca + sum.z * ab) / determinant;
    neighbours.push_back({found_[k], Vec3f(slope)});
  }
}

FacetValues::FacetValues(const TriMesh& mesh, const Elements& elements)
    : element_of_(mesh.triangles.size(), is_by_itself),
      from_middle_(mesh.triangles.size()),
      first_(elements.count() + 1) {
  const SmoothCorners corners(mesh);
  std::vector<Vec3d> middles(elements.count());
  for (std::size_t e = 0; e < middles.size(); ++e) middles[e] = elements.middle(e);
  std::vector<std::vector<Neighbour>> of_range((elements.count() + grain - 1) / grain);
  parallel_for(elements.count(), grain, [&](std::size_t begin, std::size_t end) {
    SlopeFit slope(elements, middles, corners);
    std::vector<Neighbour>& neighbours = of_range[begin / grain];
    for (std::size_t e = begin; e < end; ++e) {
      const auto element = static_cast<std::uint32_t>(e);
      const std::size_t earlier = neighbours.size();
      if (elements.pieces_of(e).size() > 1 && !elements.are_rings()) {
        slope.fit(element, neighbours);
        for (const std::uint32_t p : elements.pieces_of(e)) {
          const Elements::Piece& piece = elements.piece(p);
          element_of_[piece.facet] = element;
          from_middle_[piece.facet] = Vec3f(middle_of(piece.corners) - middles[e]);
        }
      }
      first_[e + 1] = neighbours.size() - earlier;
    }
  });
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  neighbours_.reserve(first_.back());
  for (const auto& neighbours : of_range)
    neighbours_.insert(neighbours_.end(), neighbours.begin(), neighbours.end());
}

}  // namespace scarp
