#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/tri_mesh.h"
#include "core/triangle_tree.h"
#include "levelset/grid/layers.h"
#include "levelset/grid/stencil.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/creased_facets.h"
#include "levelset/surface/facet_shares.h"
#include "levelset/surface/kept_facets.h"

namespace scarp {

/// Facets that speeds are carried from, once or often, what finds the closest of them, and which
/// ones these were. Refers to the mesh.
struct FacetTree {
  FacetTree(const TriMesh& mesh, std::shared_ptr<const TriangleTree> its_tree)
      : facets(mesh), tree(std::move(its_tree)), is_creased(creased_facets(mesh)) {}
  explicit FacetTree(const TriMesh& mesh)
      : FacetTree(mesh, std::make_shared<const TriangleTree>(mesh)) {}

  const TriMesh& facets;
  std::shared_ptr<const TriangleTree> tree;
  std::vector<bool> is_creased;
  KeptFacets kept{};
  /// Lent for values of nodes; what is in it does not count. Null: some is made where it is needed.
  LeafValues* room = nullptr;
};

/// A node next to the surface.
struct NearNode {
  std::size_t leaf;
  int node;                  ///< offset in the leaf
  std::array<int, 3> index;  ///< of the grid
  const float* phi;          ///< in a Block
};

/// Of phi, from a pointer into a Block. Units: 1.
Vec3d central_gradient(const float* phi);

/// Carries values from the facets of a mesh to the nodes of the band: nodes next to the surface ask
/// the closest facets that face them, and from there values are constant along the normals.
///
/// Cost: a closest-point query per node next to the surface, about half a microsecond each.
class Extension {
 public:
  /// values_at(node, facets, values) is asked at nodes next to the surface.
  using ValuesAt = std::function<void(const NearNode&, std::span<const FacetShare> facets,
                                      std::span<float> values)>;

  /// distance: of facets from the surface. A surface further from a node than phi says by more than
  /// that is not its own.
  Extension(const Layers& layers, const OpenGas& gas, FacetTree& facets, double distance,
            ValuesAt values_at)
      : layers_(layers),
        frame_(layers.frame),
        band_(layers.top().band()),
        gas_(gas),
        facets_(facets.facets),
        tree_(*facets.tree),
        is_creased_(facets.is_creased),
        kept_(facets.kept),
        room_(facets.room != nullptr ? *facets.room : own_room_),
        distance_(distance),
        values_at_(std::move(values_at)) {}

  /// Shape: 512 per leaf, of each of the given number of values; is_inert one per layer, or
  ///        empty. With still_within nodes in solid that does not move have values of 0.
  std::vector<std::vector<float>> run(std::size_t value_count,
                                      const std::vector<bool>& is_inert = {},
                                      bool still_within = false);

 private:
  struct Question;

  void query_leaf(std::size_t n, Block& block, std::vector<std::vector<float>>& fields);
  TriangleTree::Neighbourhood neighbourhood(const Leaf& leaf, const LeafMask& nodes) const;
  double limit(float phi) const {
    // A node next to the surface has a vertex on one of its edges, whatever corners facets cut off.
    return std::max(std::abs(phi), 0.5F) * frame_.spacing + distance_;
  }
  Question question(const NearNode& at) const;
  ClosestPoint kept_answer(const Question& asked, std::uint32_t kept) const;
  ClosestPoint search(const Question& asked, const TriangleTree::Neighbourhood& near,
                      std::uint32_t guess, TriangleTree::Others& others) const;
  ClosestPoint search_all_around(const Question& asked,
                                 const TriangleTree::Neighbourhood& near) const;
  /// What is further away than that does not count beside it.
  double reach_of(const ClosestPoint& point) const;
  bool is_void(const NearNode& at) const;

  const Layers& layers_;
  const Frame& frame_;
  const Band& band_;
  const OpenGas& gas_;
  const TriMesh& facets_;
  const TriangleTree& tree_;
  const std::vector<bool>& is_creased_;
  KeptFacets& kept_;
  LeafValues own_room_;
  LeafValues& room_;
  double distance_;
  ValuesAt values_at_;
};

}  // namespace scarp
