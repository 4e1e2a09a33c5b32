#include "tests/bench/peers.h"

#ifdef SCARP_HAS_VTK

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkQuadricDecimation.h>
#include <vtkSmartPointer.h>

namespace scarp::bench {
namespace {

vtkSmartPointer<vtkPolyData> converted(const TriMesh& mesh) {
  vtkNew<vtkPoints> points;
  for (const Vec3f& r : mesh.vertices) points->InsertNextPoint(r.x, r.y, r.z);
  vtkNew<vtkCellArray> facets;
  for (const Triangle& t : mesh.triangles) facets->InsertNextCell({t[0], t[1], t[2]});
  auto result = vtkSmartPointer<vtkPolyData>::New();
  result->SetPoints(points);
  result->SetPolys(facets);
  return result;
}

TriMesh converted(vtkPolyData& data) {
  TriMesh result;
  for (vtkIdType v = 0; v < data.GetNumberOfPoints(); ++v) {
    const double* r = data.GetPoint(v);
    result.vertices.push_back(Vec3f(Vec3d{r[0], r[1], r[2]}));
  }
  vtkNew<vtkIdList> corners;
  for (vtkIdType f = 0; f < data.GetNumberOfPolys(); ++f) {
    data.GetPolys()->GetCellAtId(f, corners);
    Triangle t;
    for (int i = 0; i < 3; ++i) t[i] = static_cast<std::uint32_t>(corners->GetId(i));
    result.triangles.push_back(t);
  }
  return result;
}

Job quadrics(const TriMesh& mesh, std::size_t vertices) {
  const auto decimation = vtkSmartPointer<vtkQuadricDecimation>::New();
  decimation->SetInputData(converted(mesh));
  decimation->SetTargetReduction(1 - static_cast<double>(facets_left(mesh, vertices)) /
                                         static_cast<double>(mesh.triangles.size()));
  return {[=] { decimation->Update(); }, [=] { return converted(*decimation->GetOutput()); }};
}

}  // namespace

Peer vtk_peer() { return {"libvtk9-dev", {{"vtk", quadrics}}}; }

}  // namespace scarp::bench

#else

namespace scarp::bench {
Peer vtk_peer() { return {"libvtk9-dev"}; }
}  // namespace scarp::bench

#endif
