#include "mesh/files/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/system/atomic_file.h"
#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class MeshFile : public testing::Test {
 protected:
  fs::path file(const std::string& name) const { return folder_ / name; }

  fs::path file_with(const std::string& name, const std::string& content) const {
    std::ofstream(file(name), std::ios::binary) << content;
    return file(name);
  }

  std::string content(const fs::path& path) const {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  TemporaryFolder folder_;
};

fs::path reference(const std::string& name) {
  return fs::path(SCARP_SOURCE_DIR) / "tests/reference/meshes" / name;
}

std::string message_of(const fs::path& path) {
  try {
    read_mesh(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

/// A polygon of corners on a circle, as .obj.
std::string disc(int corners) {
  std::string text;
  for (int n = 0; n < corners; ++n) {
    const double angle = 2 * std::numbers::pi * n / corners;
    text += "v " + std::to_string(std::cos(angle)) + ' ' + std::to_string(std::sin(angle)) + " 0\n";
  }
  text += "f";
  for (int n = 1; n <= corners; ++n) text += ' ' + std::to_string(n);
  return text + '\n';
}

TEST_F(MeshFile, APolygonBecomesTrianglesThatShareFewCorners) {
  const TriMesh mesh = read_mesh(file_with("disc.obj", disc(5000)));
  ASSERT_EQ(mesh.triangles.size(), 4998U);
  double area = 0;
  std::vector<int> at_vertex(5000);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    const Vec3d twice = cross(b - a, c - a);
    EXPECT_GT(twice.z, -1e-9);
    area += twice.z / 2;
    for (const std::uint32_t v : mesh.triangles[f]) ++at_vertex[v];
  }
  EXPECT_NEAR(area, std::numbers::pi, 1e-4);
  EXPECT_LE(*std::ranges::max_element(at_vertex), 2 * 13);  // the binary logarithm of 5000
  const TriMesh square = read_mesh(file_with("square.obj", disc(4)));
  EXPECT_EQ(square.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

// Halves of a star would lie outside of it. It faces down, and every second corner is an inner one.
TEST_F(MeshFile, APolygonThatIsNotConvexIsCutWithinItself) {
  constexpr int points = 7;
  std::string text;
  for (int n = 0; n < 2 * points; ++n) {
    const double angle = -std::numbers::pi * n / points;
    const double radius = n % 2 == 0 ? 1 : 0.2;
    text += "v " + std::to_string(radius * std::cos(angle)) + ' ' +
            std::to_string(radius * std::sin(angle)) + " 3\n";
  }
  text += "f";
  for (int n = 1; n <= 2 * points; ++n) text += ' ' + std::to_string(n);
  const TriMesh mesh = read_mesh(file_with("star.obj", text + '\n'));
  ASSERT_EQ(mesh.triangles.size(), 2U * points - 2);
  double area = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Vec3d own = area_vector(mesh, f);
    EXPECT_LT(own.z, 0) << f;
    area += own.z;
  }
  EXPECT_NEAR(area, -points * 0.2 * std::sin(std::numbers::pi / points), 1e-5);
}

// At 1e6 floats are a sixteenth apart.
TEST_F(MeshFile, WhatIsTooFarFromTheOriginForItsFacetsIsRefused) {
  const auto at = [&](const std::string& x, double size) {
    const std::string s = std::to_string(size);
    return file_with(
        "far.obj", "v " + x + " 0 0\nv " + x + ' ' + s + " 0\nv " + x + " 0 " + s + "\nf 1 2 3\n");
  };
  EXPECT_EQ(message_of(at("1e6", 7)), "no error");
  EXPECT_THAT(message_of(at("1e6", 5)), HasSubstr("move it to the origin"));
}

TEST_F(MeshFile, APolygonThatCrossesItselfIsRefused) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 3 0\n";
  for (const char* face : {"f 1 2 4 3\n", "f 1 3 2 4 5\n"})
    EXPECT_THAT(message_of(file_with("crossed.obj", corners + face)),
                HasSubstr("corners that begins at vertex 0 (counted from 0) crosses itself; cut it "
                          "into triangles"))
        << face;
}

TEST_F(MeshFile, AVertexWithTooManyFacetsIsNamed) {
  const auto star = [&](int facets) {
    std::string text = "v 0 0 -1\nv 1 0 0\nv 0 0 9\n";
    for (int n = 0; n < facets; ++n) text += "v " + std::to_string(n) + " 5 0\n";
    for (int n = 0; n < facets; ++n) text += "f 1 2 " + std::to_string(4 + n) + '\n';
    return file_with("star.obj", text);
  };
  EXPECT_EQ(message_of(star(4096)), "no error");
  EXPECT_THAT(message_of(star(4097)),
              HasSubstr("star.obj: 4097 facets meet at vertex 0 (counted from 0), where at most "
                        "4096 may; cut them"));
}

/// A tent of four triangles, coordinates without a short decimal form, one vertex unused.
TriMesh tent() {
  return {{{0.1F, 0, -1.0F / 3}, {1, 0.7F, 0}, {2e-7F, 1, 0}, {-1, 1e6F, 0}, {5, 5, 5}, {0, 0, 2}},
          {{0, 1, 5}, {1, 2, 5}, {2, 3, 5}, {3, 0, 5}},
          {}};
}

class MeshFileFormat : public MeshFile, public testing::WithParamInterface<const char*> {};

TEST_P(MeshFileFormat, ReadsBackWhatWasWritten) {
  const TriMesh mesh = tent();
  const fs::path path = file(std::string("tent") + GetParam());
  write_mesh(path, mesh);
  const TriMesh back = read_mesh(path);
  EXPECT_EQ(back.vertices, mesh.vertices);
  EXPECT_EQ(back.triangles, mesh.triangles);
}
INSTANTIATE_TEST_SUITE_P(KeepsOrder, MeshFileFormat, testing::Values(".obj", ".ply", ".vtp"));

TEST_F(MeshFile, StlJoinsEqualCornersInOrderOfFirstUse) {
  const TriMesh mesh = tent();
  write_mesh(file("tent.stl"), mesh);
  const TriMesh back = read_mesh(file("tent.stl"));
  ASSERT_EQ(back.vertices.size(), 5U);  // the unused one is gone
  ASSERT_EQ(back.triangles.size(), 4U);
  for (std::size_t f = 0; f < 4; ++f) EXPECT_EQ(corners(back, f), corners(mesh, f));
  EXPECT_EQ(back.triangles[0], (Triangle{0, 1, 2}));
}

TEST_F(MeshFile, ReadsTextStl) {
  const TriMesh mesh = read_mesh(file_with("a.stl",
                                           "solid name\n facet normal 0 0 1\n  outer loop\n"
                                           "   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n"
                                           "  endloop\n endfacet\nendsolid\n"));
  EXPECT_EQ(mesh.vertices.size(), 3U);
  EXPECT_EQ(mesh.triangles.size(), 1U);
}

TEST_F(MeshFile, ReadsTheObjThatOthersWrite) {
  const TriMesh mesh = read_mesh(file_with("a.obj",
                                           "# comment\r\nmtllib a.mtl\nvn 0 0 1\nv 0 0 0 1\r\n"
                                           "v 1 0 0\nv 1 1 0\nv +0 1e0 0\no square\n"
                                           "f 1/1/1 2//1 3/2 4 # a square\nf -4 -3 -2\n"));
  ASSERT_EQ(mesh.vertices.size(), 4U);
  ASSERT_EQ(mesh.triangles.size(), 3U);
  EXPECT_EQ(mesh.triangles[1], (Triangle{0, 2, 3}));
  EXPECT_EQ(mesh.triangles[2], (Triangle{0, 1, 2}));
}

TEST_F(MeshFile, ReadsPlyOfTextWithOtherProperties) {
  const TriMesh mesh = read_mesh(
      file_with("a.ply",
                "ply\nformat ascii 1.0\ncomment x\nelement vertex 3\nproperty double x\n"
                "property float nx\nproperty double y\nproperty double z\nelement face 1\n"
                "property uchar red\nproperty list uchar uint vertex_index\nend_header\n"
                "0 9 0 0\n1 9 0 0\n0 9 1 0\n255 3 0 1 2\n"));
  ASSERT_EQ(mesh.triangles.size(), 1U);
  EXPECT_EQ(mesh.vertices[2], (Vec3f{0, 1, 0}));
}

TEST_F(MeshFile, ReadsPlyOfBothByteOrders) {
  std::string body;
  const auto append = [&body](auto value) {
    std::string bytes(sizeof(value), '\0');
    std::memcpy(bytes.data(), &value, sizeof(value));
    body.append(bytes.rbegin(), bytes.rend());
  };
  for (const float x : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.5F}) append(x);
  append(std::uint8_t{3});
  for (const std::int32_t v : {0, 1, 2}) append(v);
  const TriMesh mesh =
      read_mesh(file_with("a.ply",
                          "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\n"
                          "property float y\nproperty float z\nelement face 1\n"
                          "property list uchar int vertex_indices\nend_header\n" +
                              body));
  EXPECT_EQ(mesh.vertices[2], (Vec3f{0, 1, 0.5F}));
  EXPECT_EQ(mesh.triangles[0], (Triangle{0, 1, 2}));
}

TEST_F(MeshFile, ReadsVtpOfTextAndOfBase64) {
  const std::string start =
      "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\"><PolyData><Piece "
      "NumberOfPoints=\"4\" NumberOfPolys=\"1\">";
  const std::string polys =
      "<Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>"
      "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray></Polys>"
      "</Piece></PolyData></VTKFile>";
  const TriMesh text = read_mesh(
      file_with("a.vtp", start +
                             "<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" "
                             "format=\"ascii\">0 0 0 1 0 0\n1 1 0 0 1 0.5</DataArray></Points>" +
                             polys));
  EXPECT_EQ(text.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));

  // The same points: 48 bytes in front of twelve floats.
  const TriMesh base64 = read_mesh(file_with(
      "b.vtp",
      start +
          "<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" "
          "format=\"binary\">\nMAAAAAAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAIA/AAAAAAAAAAAAA"
          "IA/AAAAPw==\n</DataArray></Points>" +
          polys));
  EXPECT_EQ(base64.vertices, text.vertices);
}

TEST_F(MeshFile, VtpKeepsMaterials) {
  TriMesh mesh = tent();
  mesh.materials = {7, 7, 2, 65535};
  write_mesh(file("a.vtp"), mesh);
  EXPECT_EQ(read_mesh(file("a.vtp")).materials, mesh.materials);
}

TEST_F(MeshFile, VtpCarriesTheNamesOfMaterials) {
  write_vtp(file("a.vtp"), tent(), {.facets = {}, .vertices = {}, .material_names = {"Si", "W"}});
  EXPECT_THAT(content(file("a.vtp")),
              HasSubstr("<DataArray type=\"String\" Name=\"material_names\" NumberOfTuples=\"2\" "
                        "format=\"ascii\">\n83 105 0\n87 0\n      </DataArray>"));
  EXPECT_EQ(read_mesh(file("a.vtp")).triangles, tent().triangles);
}

TEST_F(MeshFile, VtpCarriesNamedArraysOnFacetsAndVertices) {
  const TriMesh mesh = tent();
  const std::vector<float> flux{0.25F, 0.5F, 0.75F, 1};
  const std::vector<std::int32_t> region{1, 2, 3, 4};
  const std::vector<double> distance{0, 1, 2, 3, 4, 5};
  const std::vector<Vec3f> normal(6, Vec3f{0, 0, 1});
  write_vtp(file("a.vtp"), mesh,
            {.facets = {{"flux <Si & \"SiO2\">", std::span(flux)}, {"region", std::span(region)}},
             .vertices = {{"distance", std::span(distance)}, {"normal", std::span(normal)}}});
  EXPECT_EQ(read_mesh(file("a.vtp")).triangles, mesh.triangles);

  const std::string bytes = content(file("a.vtp"));
  EXPECT_THAT(bytes, AllOf(HasSubstr("Name=\"flux &lt;Si &amp; &quot;SiO2&quot;&gt;\" "
                                     "NumberOfComponents=\"1\""),
                           HasSubstr("type=\"Int32\" Name=\"region\""),
                           HasSubstr("type=\"Float64\" Name=\"distance\""),
                           HasSubstr("Name=\"normal\" NumberOfComponents=\"3\"")));
  // The bytes of the values stand behind the underscore, each array after its size.
  std::string array(sizeof(std::uint64_t) + sizeof(float) * flux.size(), '\0');
  const std::uint64_t size = sizeof(float) * flux.size();
  std::memcpy(array.data(), &size, sizeof(size));
  std::memcpy(array.data() + sizeof(size), flux.data(), size);
  EXPECT_THAT(bytes, HasSubstr(array));
}

TEST_F(MeshFile, SeriesNumbersItsFiles) {
  const std::vector<std::string> outputs{"surface_0000.vtp", "a&b.vtp"};
  write_series(file("surface.pvd"), outputs);
  EXPECT_THAT(content(file("surface.pvd")),
              AllOf(HasSubstr("<VTKFile type=\"Collection\""),
                    HasSubstr("timestep=\"0\" part=\"0\" file=\"surface_0000.vtp\""),
                    HasSubstr("timestep=\"1\" part=\"0\" file=\"a&amp;b.vtp\"")));
}

TEST_F(MeshFile, UnknownEndingIsRefused) {
  EXPECT_THAT(message_of(file_with("mesh.off", "OFF")), HasSubstr(".obj, .ply, .stl or .vtp"));
  try {
    write_mesh(file("new.off"), tent());
    ADD_FAILURE() << "written";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(".stl, .vtp or .vtu"));
  }
  EXPECT_THROW(write_vtp(file("mesh.obj"), tent(), {}), InputError);
  EXPECT_FALSE(fs::exists(file("new.off")));
}

TEST_F(MeshFile, UnreadableAndEmptyFilesAreRefusedWithTheirName) {
  EXPECT_THAT(message_of(file("none.obj")),
              AllOf(HasSubstr("none.obj"), HasSubstr("No such file")));
  fs::create_directory(file("folder.obj"));
  EXPECT_THAT(message_of(file("folder.obj")), HasSubstr("it is a folder"));
  for (const char* name : {"e.obj", "e.ply", "e.stl", "e.vtp"}) {
    EXPECT_THAT(message_of(file_with(name, "")), AllOf(HasSubstr(name), HasSubstr("empty")))
        << name;
  }
}

TEST_F(MeshFile, ObjErrorsNameTheLine) {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const auto message = [&](const std::string& text) {
    return message_of(file_with("a.obj", text));
  };
  EXPECT_THAT(message("v 0 0 nan\n"), AllOf(HasSubstr("a.obj:1: "), HasSubstr("not a finite")));
  EXPECT_THAT(message("v 0 0 0\nv 0 inf 0\n"), HasSubstr("a.obj:2: "));
  EXPECT_THAT(message("v 0 0 1e60\n"), HasSubstr("a.obj:1: "));
  EXPECT_THAT(message("v 0 0 zero\n"), HasSubstr("\"zero\" is not a number"));
  EXPECT_THAT(message("v 0 0"), HasSubstr("end early"));
  EXPECT_THAT(message(points + "f 1 2 4\n"), AllOf(HasSubstr("a.obj:4: "), HasSubstr("corner 4")));
  EXPECT_THAT(message(points + "f 1 2 -4\n"), HasSubstr("a.obj:4: "));
  EXPECT_THAT(message(points + "f 0 1 2\n"), HasSubstr("count from 1"));
  EXPECT_THAT(message(points + "f 1 2"), AllOf(HasSubstr("a.obj:4: "), HasSubstr("end early")));
  EXPECT_THAT(message(points), HasSubstr("no triangles"));
  EXPECT_THAT(message("hello\n"), HasSubstr("no vertices"));
}

TEST_F(MeshFile, NonFiniteCoordinatesOfBinaryFilesNameTheVertex) {
  TriMesh mesh = tent();
  mesh.vertices[1].y = std::numeric_limits<float>::infinity();
  mesh.vertices[5].z = std::numeric_limits<float>::quiet_NaN();
  for (const char* name : {"n.ply", "n.stl", "n.vtp"}) {
    write_mesh(file(name), mesh);
    EXPECT_THAT(message_of(file(name)),
                AllOf(HasSubstr(name), HasSubstr("vertex 1 "), HasSubstr("not finite")));
  }
}

TEST_F(MeshFile, WhatNumbersCannotMeasureIsRefused) {
  for (const float size : {1e-25F, 1e16F}) {
    TriMesh mesh = tent();
    for (Vec3f& r : mesh.vertices) r = size * r;
    write_mesh(file("size.ply"), mesh);
    EXPECT_THAT(message_of(file("size.ply")),
                AllOf(HasSubstr("size.ply"), HasSubstr("scale the mesh")));
  }
}

TEST_F(MeshFile, IndicesWithoutAVertexAreRefused) {
  TriMesh mesh = tent();
  mesh.triangles[2][1] = 6;
  for (const char* name : {"i.ply", "i.vtp"}) {
    write_mesh(file(name), mesh);
    EXPECT_THAT(message_of(file(name)),
                AllOf(HasSubstr("triangle 2 "), HasSubstr("not among the 6 vertices")));
  }
}

std::string text_ply(const std::string& extra, const std::string& count_type,
                     const std::string& index_type, const std::string& face) {
  return "ply\nformat ascii 1.0\n" + extra +
         "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 1\nproperty list " +
         count_type + ' ' + index_type + " vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n" +
         face + '\n';
}

TEST_F(MeshFile, PlyElementsWithoutPropertiesTakeNoTime) {
  const fs::path path =
      file_with("p.ply", text_ply("element foo 9000000000000000000\n", "uchar", "int", "3 0 1 2"));
  EXPECT_EQ(read_mesh(path).triangles.size(), 1U);
}

TEST_F(MeshFile, PlyNumbersThatCountOrNameAreWhole) {
  struct Case {
    const char* face;
    const char* message;
  };
  for (const auto& [face, message] :
       {Case{"1e30 0 1 2", "the length of a list is 1"}, Case{"nan 0 1 2", "a list is nan"},
        Case{"-3 0 1 2", "negative length"}, Case{"3 0 1.5 2", "a corner is 1.5"},
        Case{"3 0 1e30 2", "a corner is 1"}, Case{"3 0 nan 2", "a corner is nan"},
        Case{"3 0 4294967296 2", "not among the 3"}, Case{"3 0 -1 2", "not among the 3"}}) {
    EXPECT_THAT(message_of(file_with("w.ply", text_ply("", "float", "double", face))),
                HasSubstr(message))
        << face;
  }
}

std::string text_vtp(const std::string& corners, const std::string& offset,
                     const std::string& material) {
  const auto array = [](const std::string& name, const std::string& values) {
    return "<DataArray type=\"Float64\" Name=\"" + name + "\" format=\"ascii\">" + values +
           "</DataArray>";
  };
  return "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\">"
         "<CellData>" +
         array("material", material) + "</CellData><Points>" +
         array("points", "0 0 0 1 0 0 0 1 0") + "</Points><Polys>" +
         array("connectivity", corners) + array("offsets", offset) +
         "</Polys></Piece></PolyData></VTKFile>";
}

TEST_F(MeshFile, VtpNumbersThatCountOrNameAreWholeAndInRange) {
  EXPECT_EQ(read_mesh(file_with("g.vtp", text_vtp("0 1 2", "3", "65535"))).materials.at(0), 65535);
  struct Case {
    const char* corners;
    const char* offset;
    const char* material;
    const char* message;
  };
  for (const auto& [corners, offset, material, message] :
       {Case{"0 1 2", "3", "nan", "array material"}, Case{"0 1 2", "3", "70000", "0 to 65535"},
        Case{"0 1 2", "3", "-1", "array material"}, Case{"0 1.5 2", "3", "1", "1.5"},
        Case{"0 nan 2", "3", "1", "nan"}, Case{"0 1 2", "nan", "1", "array offsets"},
        Case{"0 1 2", "1e300", "1", "array offsets"}, Case{"0 1 2", "3.5", "1", "array offsets"}}) {
    EXPECT_THAT(message_of(file_with("b.vtp", text_vtp(corners, offset, material))),
                HasSubstr(message))
        << message;
  }
}

TEST_F(MeshFile, ATextStlThatIsCutOffBetweenFacetsIsRefused) {
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
      "endloop\nendfacet\n";
  const std::string solid = "solid a\n" + facet;
  EXPECT_THAT(message_of(file_with("c.stl", solid)), HasSubstr("without \"endsolid\""));
  EXPECT_THAT(message_of(file_with("d.stl", solid + "endsolid a\n" + solid)),
              HasSubstr("without \"endsolid\""));
  EXPECT_EQ(read_mesh(file_with("w.stl", solid + "endsolid a\n" + solid + "endsolid b")).triangles,
            (std::vector<Triangle>{{0, 1, 2}, {0, 1, 2}}));
}

TEST_F(MeshFile, NoPrefixOfAFileIsTakenForAMesh) {
  TriMesh mesh = tent();
  mesh.vertices.resize(6);
  for (const char* name : {"t.obj", "t.ply", "t.stl", "t.vtp"}) {
    write_mesh(file(name), mesh);
    const std::string whole = content(file(name));
    // The lines behind the last array of a .vtp and the last digits of an .obj carry no shape.
    const std::size_t tail = name[2] == 'v' ? 30 : 2;
    for (std::size_t size = 0; size + tail < whole.size(); size += 1 + size / 15) {
      // An .obj may lose whole lines: only cuts that leave a face undone can be seen.
      if (name[2] == 'o' && (size == 0 || whole.find('f') < size)) continue;
      EXPECT_NE(message_of(file_with(name, whole.substr(0, size))), "no error")
          << name << " cut after " << size << " of " << whole.size() << " bytes";
    }
  }
}

TEST_F(MeshFile, VtpOfUnknownKindsIsRefusedByName) {
  const auto vtp = [&](const std::string& attributes) {
    return message_of(file_with("c.vtp", "<VTKFile " + attributes + "/>"));
  };
  const std::string poly = "type=\"PolyData\" ";
  EXPECT_THAT(vtp(poly + "compressor=\"vtkLZ4DataCompressor\""),
              AllOf(HasSubstr("\"vtkLZ4DataCompressor\""), HasSubstr("ZLib or none")));
  EXPECT_THAT(vtp(poly + "compressor=\"vtkLZMADataCompressor\""),
              HasSubstr("\"vtkLZMADataCompressor\""));
  EXPECT_THAT(vtp(poly + "header_type=\"UInt16\""), HasSubstr("header_type \"UInt16\""));
  EXPECT_THAT(vtp(poly + "byte_order=\"BigEndian\""), HasSubstr("big-endian"));
  EXPECT_THAT(vtp("type=\"UnstructuredGrid\""), HasSubstr("not VTK polydata"));
}

TEST_F(MeshFile, CompressedVtpThatIsDamagedIsRefused) {
  const std::string whole = read_file(reference("zlib_default_vtk.vtp"));
  EXPECT_EQ(read_mesh(file_with("w.vtp", whole)).triangles.size(), 12U);
  // A byte of the stream, the number of blocks, and the size of the only one.
  for (const auto& [from, to] : {std::pair{"==eJxjYPA4z", "==eJxjYQA4z"},
                                 {"AQAAAACAAABgAAAAJQAAAA", "//8AAACAAABgAAAAJQAAAA"},
                                 {"AQAAAACAAABgAAAAJQAAAA", "AQAAAACAAAD///9/JQAAAA"}}) {
    std::string damaged = whole;
    damaged.replace(damaged.find(from), std::string_view(from).size(), to);
    EXPECT_THAT(message_of(file_with("d.vtp", damaged)), HasSubstr("damaged")) << to;
  }
}

/// Four points; piece: the rest of the tag, cells: what follows the points.
std::string square_vtp(const std::string& piece, const std::string& cells) {
  return "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"4\" " + piece +
         "><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 "
         "0 1 1 0 0 1 0</DataArray></Points>" +
         cells + "</Piece></PolyData></VTKFile>";
}

std::string vtp_cells(const std::string& kind, const std::string& connectivity,
                      const std::string& offsets) {
  return "<" + kind + "><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">" +
         connectivity + "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">" +
         offsets + "</DataArray></" + kind + ">";
}

TEST_F(MeshFile, VtpHoldsNoFewerCellsThanItStates) {
  const auto message = [&](const std::string& piece, const std::string& cells) {
    return message_of(file_with("n.vtp", square_vtp(piece, cells)));
  };
  const std::string two = vtp_cells("Polys", "0 1 2 0 2 3", "3 6");
  EXPECT_EQ(message("NumberOfPolys=\"2\"", two), "no error");
  EXPECT_EQ(message("", two), "no error");
  EXPECT_THAT(message("NumberOfPolys=\"3\"", two),
              HasSubstr("states NumberOfPolys=\"3\" and holds 2"));
  EXPECT_EQ(message("NumberOfPolys=\"1\"", two), "no error");
  EXPECT_THAT(message("NumberOfPolys=\"1\"", vtp_cells("Polys", "0 1 2 0 2 3", "3")),
              HasSubstr("offsets of Polys that do not fit"));
  EXPECT_THAT(message("NumberOfStrips=\"1\"", ""), HasSubstr("no array connectivity"));
  EXPECT_THAT(message("NumberOfPolys=\"1\"", vtp_cells("Polys", "0 1", "2")),
              HasSubstr("fewer than three corners"));
}

TEST_F(MeshFile, MaterialsOfVtpFollowLinesAndVertices) {
  const std::string cells =
      vtp_cells("Verts", "3", "1") + vtp_cells("Lines", "0 1 1 2", "2 4") +
      vtp_cells("Polys", "0 1 2 3", "4") + vtp_cells("Strips", "0 1 3 2", "4") +
      "<CellData><DataArray type=\"Int32\" Name=\"material\" format=\"ascii\">7 8 8 1 2"
      "</DataArray><DataArray type=\"Int32\" Name=\"flux\" format=\"ascii\">9 9 9 3 4</DataArray>"
      "</CellData><PointData><DataArray type=\"Int32\" Name=\"T\" format=\"ascii\">0 1 2 3"
      "</DataArray></PointData>";
  const fs::path path = file_with("m.vtp", square_vtp("NumberOfPolys=\"1\"", cells));
  const scarp::MeshFile read = read_mesh_file(path);
  EXPECT_EQ(read.mesh.triangles,
            (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 1, 3}, {3, 1, 2}}));
  EXPECT_EQ(read.mesh.materials, (std::vector<MaterialId>{1, 1, 2, 2}));
  EXPECT_THAT(read.left_out, ElementsAre("1 cell of vertices alone", "2 lines"));
  EXPECT_THAT(read.data_left_out, ElementsAre("point data \"T\"", "cell data \"flux\""));
  EXPECT_EQ(read_facet_arrays(path)[1].values, (std::vector<float>{3, 3, 4, 4}));
}

TEST_F(MeshFile, WhatIsLeftOutOfObjIsCounted) {
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const scarp::MeshFile read = read_mesh_file(
      file_with("a.obj", "mtllib a.mtl\no a\ng b\ns off\nvn 0 0 1\n" + triangle +
                             "usemtl b\nl 1 2\nl 1 \\\n 2 3\np 1\nhello\nv 1 1 1 0.5 0.5 0.5\n"));
  EXPECT_EQ(read.mesh.vertices.size(), 4U);
  EXPECT_THAT(read.left_out, ElementsAre("1 row of \"hello\"", "2 lines", "1 element of points"));
  EXPECT_THAT(read.data_left_out, ElementsAre("colours or weights of vertices", "1 normal"));
  EXPECT_EQ(left_out_text(read.left_out).substr(0, 17), "leaves out 1 row ");
  EXPECT_THAT(message_of(file_with("c.obj", triangle + "cstype bspline\n")),
              AllOf(HasSubstr("c.obj:5"), HasSubstr("\"cstype\" belongs to curves")));
  EXPECT_THAT(message_of(file_with("d.obj", triangle + "call other.obj\n")), HasSubstr("\"call\""));
  EXPECT_THAT(message_of(file_with("j.obj", triangle + "f 1 2\\\n3\n")),
              HasSubstr("goes on within a word"));
  EXPECT_THAT(message_of(file_with("u.obj", std::string("\xFF\xFEv\0", 4))), HasSubstr("UTF-16"));
}

TEST_F(MeshFile, WhatIsLeftOutOfPlyAndStlIsNamed) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
      "z\nproperty uchar red\nelement face 1\nproperty list uchar int ";
  const std::string body =
      "\nelement edge 1\nproperty int a\nend_header\n0 0 0 1\n1 0 0 1\n"
      "0 1 0 1\n3 0 1 2\n5\n6 7\n";
  const scarp::MeshFile ply = read_mesh_file(file_with("a.ply", head + "vertex_indices" + body));
  EXPECT_THAT(ply.left_out, ElementsAre("1 element \"edge\"",
                                        "4 bytes behind the elements that the file states"));
  EXPECT_THAT(ply.data_left_out, ElementsAre("data of vertex \"red\""));
  EXPECT_THAT(message_of(file_with("b.ply", head + "corners" + body)),
              HasSubstr("element face has no list vertex_indices"));

  write_mesh(file("a.stl"), tent());
  std::string bytes = content(file("a.stl"));
  bytes[84 + 49] = 1;
  const scarp::MeshFile stl = read_mesh_file(file_with("b.stl", bytes + "more"));
  EXPECT_EQ(stl.mesh.triangles.size(), 4U);
  EXPECT_THAT(stl.left_out, ElementsAre("4 bytes behind the 4 facets that the file states"));
  EXPECT_THAT(stl.data_left_out, ElementsAre("attributes of facets"));
  EXPECT_THAT(message_of(file_with("w.stl", "solid\nfacet\nouter loop\ncolour 1\n")),
              HasSubstr("w.stl:4: \"colour\" is no word of STL"));
}

TEST_F(MeshFile, ArraysOverFacetsComeBack) {
  TriMesh mesh{.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}},
               .triangles = {{0, 1, 2}, {1, 3, 2}},
               .materials = {3, 4}};
  const std::vector<float> flux{0.25F, 0.5F};
  const std::vector<double> heights{0, 1, 2, 3};
  write_vtp(folder_ / "mesh.vtp", mesh,
            {.facets = {{"flux", std::span(flux)}}, .vertices = {{"height", std::span(heights)}}});
  const std::vector<FacetArray> arrays = read_facet_arrays(folder_ / "mesh.vtp");
  ASSERT_EQ(arrays.size(), 2U);
  EXPECT_EQ(arrays[0].name, "material");
  EXPECT_EQ(arrays[1].name, "flux");
  EXPECT_EQ(arrays[1].values, flux);
}

TEST_F(MeshFile, NamesOfMaterialsComeBack) {
  const std::vector<std::string> names{"Si", "a <b> & \"c\"", "\xC2\xB5"};
  write_vtp(folder_ / "mesh.vtp", tent(), {.facets = {}, .vertices = {}, .material_names = names});
  EXPECT_EQ(read_material_names(folder_ / "mesh.vtp"), names);
  write_mesh(folder_ / "plain.vtp", tent());
  EXPECT_TRUE(read_material_names(folder_ / "plain.vtp").empty());

  std::string text = read_file(folder_ / "mesh.vtp");
  text.replace(text.find("83 105 0"), 2, "1e9");  // "Si"
  write_file(folder_ / "mesh.vtp", text);
  EXPECT_THROW(read_material_names(folder_ / "mesh.vtp"), InputError);
}

TEST_F(MeshFile, AFileThatCannotBeWrittenLeavesNothing) {
  EXPECT_THROW(write_mesh(file("no/such/folder.ply"), tent()), InputError);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(MeshFile, LargeMeshesKeepCountAndOrder) {
  TriMesh mesh;
  const std::uint32_t count = 175000;
  for (std::uint32_t v = 0; v < count; ++v) {
    mesh.vertices.push_back(
        {static_cast<float>(v % 400), 0.5F * static_cast<float>(v), 0.1F * static_cast<float>(v)});
  }
  for (std::uint32_t v = 2; v < count; ++v) mesh.triangles.push_back({v, v - 1, v - 2});
  for (const char* name : {"l.obj", "l.ply", "l.stl", "l.vtp"}) {
    write_mesh(file(name), mesh);
    const TriMesh back = read_mesh(file(name));
    EXPECT_EQ(back.vertices.size(), mesh.vertices.size());
    EXPECT_EQ(back.triangles.size(), mesh.triangles.size());
    if (name[2] != 's') {
      EXPECT_TRUE(back.vertices == mesh.vertices && back.triangles == mesh.triangles);
    }
  }
}

}  // namespace
}  // namespace scarp
