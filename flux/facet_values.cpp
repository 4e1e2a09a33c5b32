#include "flux/facet_values.h"

#include <algorithm>
#include <array>

#include "core/parallel.h"
#include "flux/reconstruct.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 64;  // elements

// What speaks for no slope, where a neighbour as large as the element counts 1: along rows of
// neighbours there is none across, and slivers with few rays, close by as they are, make none.
constexpr double ridge = 0.03;

// The slope of a plane through an element's value that fits those of its neighbours best, each
// counted by its area over its distance squared.
class SlopeFit {
 public:
  SlopeFit(const Elements& elements, const SmoothCorners& corners, std::uint32_t element);

  /// The part of each neighbour's difference from the element in what a place has more than the
  /// element's middle.
  void add_terms(Vec3d from_middle, std::vector<FacetValues::Term>& terms) const {
    double sum = 0;
    for (const Neighbour& neighbour : neighbours_) {
      const double weight = dot(from_middle, neighbour.slope);
      terms.push_back({neighbour.element, static_cast<float>(weight)});
      sum += weight;
    }
    terms.push_back({element_, static_cast<float>(-sum)});
  }

 private:
  struct Neighbour {
    std::uint32_t element;
    Vec3d slope;  // for a difference of 1
  };

  void find_neighbours(const Elements& elements, const SmoothCorners& corners);

  std::uint32_t element_;
  std::vector<Neighbour> neighbours_;
};

// Pieces of facets that are cut may lie far away.
void SlopeFit::find_neighbours(const Elements& elements, const SmoothCorners& corners) {
  for (const std::uint32_t p : elements.pieces_of(element_)) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      corners.for_each(elements.piece(p).facet, corner, [&](std::uint32_t facet, double) {
        const std::uint32_t first = elements.first_of(facet);
        const std::uint32_t found = elements.element_of(first);
        if (elements.first_of(facet + 1) != first + 1 || found == element_) return;
        const auto is_found = [&](const Neighbour& known) { return known.element == found; };
        if (std::ranges::none_of(neighbours_, is_found)) neighbours_.push_back({found, {}});
      });
    }
  }
}

SlopeFit::SlopeFit(const Elements& elements, const SmoothCorners& corners, std::uint32_t element)
    : element_(element) {
  find_neighbours(elements, corners);
  const Vec3d middle = elements.middle(element);
  std::array<Vec3d, 3> squares{};  // the normal equations
  for (Neighbour& neighbour : neighbours_) {
    const Vec3d d = elements.middle(neighbour.element) - middle;
    const double weight = std::min(1.0, elements.area(neighbour.element) / elements.area(element));
    neighbour.slope = weight / dot(d, d) * d;
    for (int axis = 0; axis < 3; ++axis)
      squares[static_cast<std::size_t>(axis)] += neighbour.slope[axis] * d;
  }
  for (int axis = 0; axis < 3; ++axis) squares[static_cast<std::size_t>(axis)][axis] += ridge;
  const auto& [a, b, c] = squares;
  const double determinant = dot(a, cross(b, c));
  for (Neighbour& neighbour : neighbours_) {
    const Vec3d sum = neighbour.slope;
    neighbour.slope =
        (sum.x * cross(b, c) + sum.y * cross(c, a) + sum.z * cross(a, b)) / determinant;
  }
}

}  // namespace

FacetValues::FacetValues(const TriMesh& mesh, const Elements& elements)
    : first_(mesh.triangles.size()), end_(mesh.triangles.size()) {
  const SmoothCorners corners(mesh);
  std::vector<std::vector<Term>> of_element(elements.count());
  parallel_for(elements.count(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      const auto pieces = elements.pieces_of(e);
      if (pieces.size() == 1) continue;
      const SlopeFit fit(elements, corners, static_cast<std::uint32_t>(e));
      const Vec3d middle = elements.middle(e);
      for (const std::uint32_t p : pieces) {
        const Elements::Piece& piece = elements.piece(p);
        first_[piece.facet] = of_element[e].size();
        fit.add_terms(middle_of(piece.corners) - middle, of_element[e]);
        end_[piece.facet] = of_element[e].size();
      }
    }
  });
  for (std::size_t e = 0; e < of_element.size(); ++e) {
    if (of_element[e].empty()) continue;
    for (const std::uint32_t p : elements.pieces_of(e)) {
      first_[elements.piece(p).facet] += terms_.size();
      end_[elements.piece(p).facet] += terms_.size();
    }
    terms_.insert(terms_.end(), of_element[e].begin(), of_element[e].end());
  }
}

}  // namespace scarp
