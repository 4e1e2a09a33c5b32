#include "flux/facet_values.h"

#include <algorithm>
#include <array>

#include "core/parallel.h"
#include "flux/reconstruct.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 256;  // elements

// What speaks for no slope, where a neighbour as large as the element counts 1: along rows of
// neighbours there is none across, and slivers with few rays, close by as they are, make none.
constexpr double ridge = 0.03;

// The slope of a plane through an element's value that fits those of its neighbours best, each
// counted by its area over its distance squared.
class SlopeFit {
 public:
  SlopeFit(const Elements& elements, std::span<const Vec3d> middles, const SmoothCorners& corners)
      : elements_(elements), middles_(middles), corners_(corners) {}

  void fit(std::uint32_t element);

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

  void find_neighbours();

  const Elements& elements_;
  std::span<const Vec3d> middles_;  // of elements
  const SmoothCorners& corners_;
  std::uint32_t element_ = 0;
  std::vector<Neighbour> neighbours_;
};

// Pieces of facets that are cut may lie far away.
void SlopeFit::find_neighbours() {
  neighbours_.clear();
  for (const std::uint32_t p : elements_.pieces_of(element_)) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      corners_.for_each(elements_.piece(p).facet, corner, [&](std::uint32_t facet, double) {
        const Elements::Pieces pieces = elements_.pieces_of_facet(facet);
        const std::uint32_t found = elements_.element_of(pieces.front());
        if (pieces.size() != 1 || found == element_) return;
        const auto is_found = [&](const Neighbour& known) { return known.element == found; };
        if (std::ranges::none_of(neighbours_, is_found)) neighbours_.push_back({found, {}});
      });
    }
  }
}

void SlopeFit::fit(std::uint32_t element) {
  element_ = element;
  find_neighbours();
  std::array<Vec3d, 3> squares{};  // the normal equations
  for (Neighbour& neighbour : neighbours_) {
    const Vec3d d = middles_[neighbour.element] - middles_[element];
    const double weight =
        std::min(1.0, elements_.area(neighbour.element) / elements_.area(element));
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
  std::vector<Vec3d> middles(elements.count());
  for (std::size_t e = 0; e < middles.size(); ++e) middles[e] = elements.middle(e);
  std::vector<std::vector<Term>> of_range((elements.count() + grain - 1) / grain);
  const auto for_each_joined = [&](std::size_t range, const auto& use) {
    const std::size_t end = std::min((range + 1) * grain, elements.count());
    for (std::size_t e = range * grain; e < end; ++e)
      if (elements.pieces_of(e).size() > 1 && !elements.are_rings())
        use(static_cast<std::uint32_t>(e));
  };
  parallel_for(of_range.size(), 1, [&](std::size_t begin, std::size_t end) {
    SlopeFit slope(elements, middles, corners);
    for (std::size_t range = begin; range < end; ++range) {
      std::vector<Term>& terms = of_range[range];
      for_each_joined(range, [&](std::uint32_t e) {
        slope.fit(e);
        for (const std::uint32_t p : elements.pieces_of(e)) {
          const Elements::Piece& piece = elements.piece(p);
          first_[piece.facet] = terms.size();
          slope.add_terms(middle_of(piece.corners) - middles[e], terms);
          end_[piece.facet] = terms.size();
        }
      });
    }
  });
  for (std::size_t range = 0; range < of_range.size(); ++range) {
    for_each_joined(range, [&](std::uint32_t e) {
      for (const std::uint32_t p : elements.pieces_of(e)) {
        first_[elements.piece(p).facet] += terms_.size();
        end_[elements.piece(p).facet] += terms_.size();
      }
    });
    terms_.insert(terms_.end(), of_range[range].begin(), of_range[range].end());
  }
}

}  // namespace scarp
