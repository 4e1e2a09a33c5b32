#pragma once

// Edge collapse by CGAL, where its headers are installed; linked without GMP and MPFR.

#if __has_include(<CGAL/Surface_mesh_simplification/edge_collapse.h>)
#define SCARP_HAS_CGAL 1
#define CGAL_DISABLE_GMP 1

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include "core/tri_mesh.h"

namespace scarp::bench {

class CgalPeer {
 public:
  using Point = CGAL::Simple_cartesian<double>::Point_3;
  using Mesh = CGAL::Surface_mesh<Point>;

  explicit CgalPeer(const TriMesh& mesh) {
    for (const Vec3f& r : mesh.vertices) mesh_.add_vertex({r.x, r.y, r.z});
    for (const Triangle& t : mesh.triangles) {
      mesh_.add_face(Mesh::Vertex_index(t[0]), Mesh::Vertex_index(t[1]), Mesh::Vertex_index(t[2]));
    }
  }

  void lindstrom_turk(std::size_t vertices) {
    namespace SMS = CGAL::Surface_mesh_simplification;
    SMS::edge_collapse(mesh_, Stop{vertices},
                       CGAL::parameters::get_cost(SMS::LindstromTurk_cost<Mesh>())
                           .get_placement(SMS::LindstromTurk_placement<Mesh>()));
  }

  TriMesh result() {
    mesh_.collect_garbage();
    TriMesh mesh;
    for (const auto v : mesh_.vertices()) {
      const Point p = mesh_.point(v);
      mesh.vertices.push_back(
          {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
    }
    for (const auto f : mesh_.faces()) {
      Triangle t;
      std::size_t i = 0;
      for (const auto v : mesh_.vertices_around_face(mesh_.halfedge(f))) t[i++] = v.idx();
      mesh.triangles.push_back(t);
    }
    return mesh;
  }

 private:
  struct Stop {
    std::size_t vertices;
    template <class Cost, class Profile>
    bool operator()(const Cost&, const Profile& profile, std::size_t, std::size_t) const {
      return profile.surface_mesh().number_of_vertices() <= vertices;
    }
  };

  Mesh mesh_;
};

}  // namespace scarp::bench

#endif
