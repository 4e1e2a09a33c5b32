#include "tests/bench/peers.h"

#ifdef SCARP_HAS_CGAL

// Linked without GMP and MPFR.
#define CGAL_DISABLE_GMP 1

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_placement.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <memory>

namespace scarp::bench {
namespace {

namespace SMS = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

Mesh converted(const TriMesh& mesh) {
  Mesh result;
  for (const Vec3f& r : mesh.vertices) result.add_vertex({r.x, r.y, r.z});
  for (const Triangle& t : mesh.triangles) {
    result.add_face(Mesh::Vertex_index(t[0]), Mesh::Vertex_index(t[1]), Mesh::Vertex_index(t[2]));
  }
  return result;
}

TriMesh converted(Mesh& mesh) {
  mesh.collect_garbage();
  TriMesh result;
  for (const auto v : mesh.vertices()) {
    const Kernel::Point_3 p = mesh.point(v);
    result.vertices.push_back(
        {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
  }
  for (const auto f : mesh.faces()) {
    Triangle t;
    std::size_t i = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) t[i++] = v.idx();
    result.triangles.push_back(t);
  }
  return result;
}

/// CGAL's own predicate counts edges.
struct Stop {
  std::size_t vertices;
  template <class Cost, class Profile>
  bool operator()(const Cost&, const Profile& profile, std::size_t, std::size_t) const {
    return profile.surface_mesh().number_of_vertices() <= vertices;
  }
};

Job lindstrom_turk(const TriMesh& mesh, std::size_t vertices) {
  const auto work = std::make_shared<Mesh>(converted(mesh));
  return {[=] {
            SMS::edge_collapse(*work, Stop{vertices},
                               CGAL::parameters::get_cost(SMS::LindstromTurk_cost<Mesh>())
                                   .get_placement(SMS::LindstromTurk_placement<Mesh>()));
          },
          [=] { return converted(*work); }};
}

/// With the guard against turned normals that its manual puts around the placement.
Job garland_heckbert(const TriMesh& mesh, std::size_t vertices) {
  using Policies = SMS::GarlandHeckbert_plane_policies<Mesh, Kernel>;
  using Guarded = SMS::Bounded_normal_change_placement<Policies::Get_placement>;
  const auto work = std::make_shared<Mesh>(converted(mesh));
  return {[=] {
            const Policies policies(*work);
            SMS::edge_collapse(*work, Stop{vertices},
                               CGAL::parameters::get_cost(policies.get_cost())
                                   .get_placement(Guarded(policies.get_placement())));
          },
          [=] { return converted(*work); }};
}

}  // namespace

Peer cgal_peer() {
  return {"libcgal-dev", {{"cgal-lt", lindstrom_turk}, {"cgal-gh", garland_heckbert}}};
}

}  // namespace scarp::bench

#else

namespace scarp::bench {
Peer cgal_peer() { return {"libcgal-dev"}; }
}  // namespace scarp::bench

#endif
