#include "tests/bench/peers.h"

#ifdef SCARP_HAS_MESHOPTIMIZER

#include <meshoptimizer.h>

#include <algorithm>
#include <memory>

namespace scarp::bench {
namespace {

using Indices = std::vector<unsigned>;

/// Only vertices that are used; they have stayed where they were.
TriMesh used_part(const TriMesh& mesh, const Indices& indices) {
  std::vector<std::uint32_t> place(mesh.vertices.size(), 0);
  for (const unsigned v : indices) place[v] = 1;
  TriMesh result;
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (place[v] == 0) continue;
    place[v] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(mesh.vertices[v]);
  }
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    result.triangles.push_back({place[indices[i]], place[indices[i + 1]], place[indices[i + 2]]});
  }
  return result;
}

Job quadrics(const TriMesh& mesh, std::size_t vertices) {
  constexpr float any_error = 1e9F;
  const auto indices = std::make_shared<Indices>();
  for (const Triangle& t : mesh.triangles) indices->insert(indices->end(), t.begin(), t.end());
  return {[=, &mesh] {
            Indices left(indices->size());
            left.resize(meshopt_simplify(left.data(), indices->data(), indices->size(),
                                         &mesh.vertices[0].x, mesh.vertices.size(), sizeof(Vec3f),
                                         3 * facets_left(mesh, vertices), any_error, 0, nullptr));
            *indices = std::move(left);
          },
          [=, &mesh] { return used_part(mesh, *indices); }};
}

}  // namespace

Peer meshoptimizer_peer() { return {"libmeshoptimizer-dev", {{"meshoptimizer", quadrics}}}; }

}  // namespace scarp::bench

#else

namespace scarp::bench {
Peer meshoptimizer_peer() { return {"libmeshoptimizer-dev"}; }
}  // namespace scarp::bench

#endif
