#include "tests/bench/peers.h"

#ifdef SCARP_HAS_OPENMESH

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <memory>

namespace scarp::bench {
namespace {

using Mesh = OpenMesh::TriMesh_ArrayKernelT<>;

Mesh converted(const TriMesh& mesh) {
  Mesh result;
  // Held here, or what is deleted is forgotten with the decimater.
  result.request_vertex_status();
  result.request_halfedge_status();
  result.request_edge_status();
  result.request_face_status();
  for (const Vec3f& r : mesh.vertices) result.add_vertex({r.x, r.y, r.z});
  for (const Triangle& t : mesh.triangles) {
    result.add_face(Mesh::VertexHandle(static_cast<int>(t[0])),
                    Mesh::VertexHandle(static_cast<int>(t[1])),
                    Mesh::VertexHandle(static_cast<int>(t[2])));
  }
  return result;
}

TriMesh converted(Mesh& mesh) {
  mesh.garbage_collection();
  TriMesh result;
  for (const auto v : mesh.vertices()) {
    const Mesh::Point p = mesh.point(v);
    result.vertices.push_back({p[0], p[1], p[2]});
  }
  for (const auto f : mesh.faces()) {
    Triangle t;
    std::size_t i = 0;
    for (const auto v : mesh.fv_range(f)) t[i++] = static_cast<std::uint32_t>(v.idx());
    result.triangles.push_back(t);
  }
  return result;
}

Job quadrics(const TriMesh& mesh, std::size_t vertices) {
  const auto work = std::make_shared<Mesh>(converted(mesh));
  return {[=] {
            OpenMesh::Decimater::DecimaterT<Mesh> decimater(*work);
            OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;
            decimater.add(quadric);
            decimater.module(quadric).unset_max_err();
            decimater.initialize();
            decimater.decimate_to(vertices);
          },
          [=] { return converted(*work); }};
}

}  // namespace

Peer openmesh_peer() { return {"libopenmesh-dev", {{"openmesh", quadrics}}}; }

}  // namespace scarp::bench

#else

namespace scarp::bench {
Peer openmesh_peer() { return {"libopenmesh-dev"}; }
}  // namespace scarp::bench

#endif
