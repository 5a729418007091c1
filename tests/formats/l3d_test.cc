// L3D: where luminaires of others and of ours shine, and archives that are refused.
#include "luxfield/formats/l3d.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/input_file.h"
#include "luxfield/formats/gldf.h"
#include "luxfield/formats/obj_faces.h"
#include "luxfield/formats/photometric_file.h"
#include "luxfield/formats/zip.h"
#include "tests/formats/lamps.h"
#include "tests/test_data.h"

namespace luxfield::formats {
namespace {

using lightfield::Length;
using lightfield::Vec3;
using testing::ElementsAre;
using testing::HasSubstr;

std::string Refusal(const std::string& bytes) {
  try {
    ParseL3d(bytes, "x.l3d");
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

void ExpectNear(Vec3 a, Vec3 b, double tolerance = 1e-9) {
  EXPECT_LT(Length(a - b), tolerance) << a.x << " " << a.y << " " << a.z;
}

// A square of 2 by 1 units that looks down, and in another group a triangle that looks up.
const std::string kMesh =
    "# a lamp\nv -1 -0.5 0\nv 1 -0.5 0\nv 1 0.5 0\nv -1 0.5 0\nvt 0 0\ng a\nf 4/1 3/1 2/1 1/1\n"
    "g b\nusemtl m\nf -4 -3 -2\n";

std::string Structure(const std::string& parts, const std::string& units = "cm") {
  return "<Luminaire><GeometryDefinitions><GeometryFileDefinition id='m' filename='m.obj' "
         "units='" +
         units + "'/></GeometryDefinitions><Structure>" + parts + "</Structure></Luminaire>";
}

std::string Part(const std::string& inside, const std::string& rotation = "x='0' y='0' z='0'") {
  return "<Geometry partName='p'><Position x='0.1' y='0.2' z='0.3'/><Rotation " + rotation +
         "/><GeometryReference geometryId='m'/>" + inside + "</Geometry>";
}

std::string Object(const std::string& rotation, const std::string& shape =
                                                    "<Circle "
                                                    "diameter='0.2'/>") {
  return "<LightEmittingObjects><LightEmittingObject partName='leo'><Position x='1' y='0' z='0'/>"
         "<Rotation " +
         rotation + "/>" + shape + "</LightEmittingObject></LightEmittingObjects>";
}

std::string Surface(const std::string& assignment) {
  return "<LightEmittingSurfaces><LightEmittingSurface partName='les'>"
         "<LightEmittingObjectReference lightEmittingPartName='leo'/><FaceAssignments>" +
         assignment + "</FaceAssignments></LightEmittingSurface></LightEmittingSurfaces>";
}

std::string Archive(const std::string& structure, const std::string& mesh = kMesh) {
  return FormatZip({{"structure.xml", structure}, {"m/m.obj", mesh}});
}

TEST(L3d, ObjectsLieInTheLuminairesFrame) {
  const LampShape plain = ParseL3d(Archive(Structure(Part(Object("x='0' y='0' z='0'")))), "x.l3d");
  ASSERT_EQ(plain.objects.size(), 1u);
  EXPECT_TRUE(plain.objects[0].round);
  EXPECT_EQ(plain.objects[0].x_m, 0.2);
  ExpectNear(plain.objects[0].centre_m, {1.1, -0.2, -0.3});
  ExpectNear(plain.objects[0].direction, {0, 0, 1});
  ExpectNear(plain.objects[0].x_axis, {1, 0, 0});
  // -90 degrees about y turn the object's -z to x.
  const LampShape aside =
      ParseL3d(Archive(Structure(Part(Object("x='0' y='-90' z='0'")))), "x.l3d");
  ExpectNear(aside.objects[0].direction, {1, 0, 0});
  // 90 about z takes x to y, then 90 about the turned x, which is y, takes -z to -x; a part that
  // is turned by 90 about z takes that to -y.
  const LampShape turned =
      ParseL3d(Archive(Structure(Part(Object("x='90' y='0' z='90'"), "x='0' y='0' z='90'"))), "x");
  ExpectNear(turned.objects[0].direction, {0, 1, 0});
  ExpectNear(turned.objects[0].centre_m, {0.1, -1.2, -0.3});
  // About x and y in another order it would be -y or -x.
  const LampShape thrice =
      ParseL3d(Archive(Structure(Part(Object("x='90' y='90' z='90'")))), "x.l3d");
  ExpectNear(thrice.objects[0].direction, {0, 1, 0});
}

TEST(L3d, SurfacesAreAreasOfFaces) {
  const auto read = [](const std::string& assignment, const std::string& units = "cm") {
    return ParseL3d(Archive(Structure(Part(Surface(assignment)), units)), "x.l3d").surfaces.at(0);
  };
  const EmittingSurface square = read("<FaceAssignment faceIndex='0'/>");
  EXPECT_THAT(square.objects, ElementsAre("leo"));
  EXPECT_EQ(square.faces, 1u);
  EXPECT_NEAR(square.area_m2, 2e-4, 1e-12);
  ExpectNear(square.direction, {0, 0, 1});
  const EmittingSurface triangle = read("<FaceAssignment groupIndex='1' faceIndex='0'/>");
  EXPECT_NEAR(triangle.area_m2, 1e-4, 1e-12);
  ExpectNear(triangle.direction, {0, 0, -1});
  const EmittingSurface both = read(
      "<FaceAssignment groupIndex='1' faceIndex='0'/>"
      "<FaceRangeAssignment faceIndexBegin='0' faceIndexEnd='0'/>",
      "inch");
  EXPECT_EQ(both.faces, 2u);
  EXPECT_NEAR(both.area_m2, 3 * 0.0254 * 0.0254, 1e-12);
  ExpectNear(both.direction, {0, 0, 1.0 / 3});
}

TEST(L3d, JointsStandByDefault) {
  const std::string joint =
      "<Joints><Joint partName='j'><Position x='0' y='0' z='-1'/><Rotation x='0' y='0' z='0'/>"
      "<YAxis min='-30' max='60' step='1'/><DefaultRotation x='0' y='-90' z='0'/><Geometries>" +
      Part(Object("x='0' y='0' z='0'")) + "</Geometries></Joint></Joints>";
  const LampShape shape = ParseL3d(Archive(Structure(Part(joint))), "x.l3d");
  ExpectNear(shape.objects.at(0).direction, {1, 0, 0});
  // In L3D's frame (0.1, 0.2, 0.3) + (0, 0, -1) + R_y(-90) (1.1, 0.2, 0.3).
  ExpectNear(shape.objects[0].centre_m, {0.1 - 0.3, -0.4, -(0.3 - 1 + 1.1)});
}

TEST(L3d, WhatIsWrongIsNamed) {
  EXPECT_THAT(Refusal("x"), HasSubstr("x.l3d: is no ZIP archive"));
  EXPECT_THAT(Refusal(FormatZip({})), HasSubstr("has no member 'structure.xml'"));
  EXPECT_THAT(Refusal(Archive("<Root/>")), HasSubstr("<Root> is not L3D's <Luminaire>"));
  EXPECT_THAT(Refusal(Archive("<Luminaire/>")), HasSubstr("line 1: has no <Structure>"));
  const auto part = [](const std::string& inside, const std::string& units = "m") {
    return Refusal(Archive(Structure(Part(inside), units)));
  };
  EXPECT_THAT(part(Object("x='0' y='0'")), HasSubstr("z = '' of <Rotation> is no number"));
  EXPECT_THAT(part(Object("x='0' y='0' z='nan'")), HasSubstr("z = 'nan'"));
  EXPECT_THAT(part(Object("x='0' y='0' z='1e7'")), HasSubstr("no number up to 1e6"));
  EXPECT_THAT(part(Object("x='0' y='0' z='0'", "")), HasSubstr("has neither shape"));
  EXPECT_THAT(part(Object("x='0' y='0' z='0'", "<Circle diameter='0'/>")),
              HasSubstr("diameter = 0 is not above 0"));
  EXPECT_THAT(part(Surface("<FaceAssignment faceIndex='1'/>")),
              HasSubstr("no faces 1 to 1 in group 0"));
  EXPECT_THAT(part(Surface("<FaceAssignment groupIndex='2' faceIndex='0'/>")),
              HasSubstr("in group 2"));
  EXPECT_THAT(part(Surface("<FaceRangeAssignment faceIndexBegin='0' faceIndexEnd='-1'/>")),
              HasSubstr("no faces 0 to -1"));
  EXPECT_THAT(part(Surface("<FaceAssignment faceIndex='0'/>"), "ell"),
              HasSubstr("units 'ell' are not known"));
  EXPECT_THAT(Refusal(FormatZip({{"structure.xml", Structure(Part(Surface("")))}})),
              HasSubstr("no member 'm/m.obj'"));
  for (const auto& [mesh, problem] :
       {std::pair{"v 1 2 x\n", "line 1: 'x' is no coordinate"},
        std::pair{"v 1 2 1e99\n", "'1e99' is no coordinate"},
        std::pair{"v 0 0 0\nf 1 1 2\n", "line 2: '2' is none of the 1 vertices"},
        std::pair{"v 0 0 0\nf -2 1 1\n", "'-2' is none"},
        std::pair{"v 0 0 0\nf 0 1 1\n", "'0' is none"},
        std::pair{"v 0 0 0\nf\n", "a face has no vertices"},
        std::pair{"v 0 0 0\nf 1 1\n", "less than three vertices"}})
    EXPECT_THAT(Refusal(Archive(Structure(Part(Surface(""))), mesh)), HasSubstr(problem)) << mesh;
}

// Parts in parts without end, and faces counted over and over, cost no time and no stack.
TEST(L3d, HostileStructuresAreRefusedSoon) {
  std::string deep, close;
  for (int k = 0; k < 40; ++k) {
    deep += "<Geometry><Joints><Joint><Geometries>";
    close = "</Geometries></Joint></Joints></Geometry>" + close;
  }
  EXPECT_THAT(Refusal(Archive(Structure(deep + close))), HasSubstr("nested more than 64 deep"));
  std::string mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", ranges;
  for (int k = 0; k < 100000; ++k) mesh += "f 1 2 3\n";
  for (int k = 0; k < 20000; ++k)
    ranges += "<FaceRangeAssignment faceIndexBegin='0' faceIndexEnd='99999'/>";
  const LampShape shape = ParseL3d(Archive(Structure(Part(Surface(ranges))), mesh), "x.l3d");
  EXPECT_EQ(shape.surfaces.at(0).faces, 2000000000u);
}

// What FormatL3d says of an opening is what is read of it, in the luminaire's frame.
TEST(L3d, OpeningsAreWrittenAsTheyAreRead) {
  const Vec3 middle{0.02, -0.03, 0.004};
  using enum Opening::Shape;
  for (const Opening& opening :
       {Opening{kBox, 0.3, 0.2, 0}, Opening{kBox, 0.3, 0.2, 0.05}, Opening{kEllipse, 0.1, 0.1, 0},
        Opening{kEllipse, 0.1, 0.1, 0.04}}) {
    SCOPED_TRACE(Describe(opening));
    const auto bytes = FormatL3d(opening, middle, "test <1>");
    ASSERT_TRUE(bytes);
    const LampShape shape = ParseL3d(*bytes, "x.l3d");
    ASSERT_EQ(shape.objects.size(), 1u);
    const EmittingObject& object = shape.objects[0];
    EXPECT_EQ(object.name, kEmittingObject);
    EXPECT_EQ(object.round, opening.shape == kEllipse);
    EXPECT_EQ(object.x_m, opening.c0_m);
    EXPECT_EQ(object.y_m, opening.c90_m);
    EXPECT_THAT(object.heights_m, testing::Each(opening.height_m));
    ExpectNear(object.centre_m, middle + Vec3{0, 0, opening.height_m / 2});
    ExpectNear(object.direction, {0, 0, 1});
    ASSERT_EQ(shape.surfaces.size(), 1u);
    const EmittingSurface& surface = shape.surfaces[0];
    // A polygon of 64 corners has sin(x)/x of the disc's area, x = 2 pi / 64, and chords for arcs.
    const double x = 2 * std::numbers::pi / 64;
    const double area = object.round ? std::numbers::pi / 4 * 0.01 * std::sin(x) / x : 0.06;
    const double outline = object.round ? 64 * 0.1 * std::sin(x / 2) : 1.0;
    EXPECT_NEAR(surface.area_m2, area + outline * opening.height_m, 1e-9);
    // Sides look all around.
    ExpectNear(surface.direction, {0, 0, area / surface.area_m2}, 1e-7);
  }
  for (const Opening& opening :
       {Opening{}, Opening{kEllipse, 0.2, 0.1, 0}, Opening{kEllipsoid, 1, 1, 1},
        Opening{kCylinderAlongC0, 2, 1, 1}, Opening{kVerticalDisc, 0, 1, 1}})
    EXPECT_FALSE(FormatL3d(opening, middle, "test")) << Describe(opening);
}

TEST(L3d, LiesInGldfContainers) {
  Photometry p = RandomLamp(PhotometryType::kC, 4);
  const auto shape = ParseGldfShape(FormatGldf(p, {0, 0.1, 0}, "test", "x.gldf"), "x.gldf");
  ASSERT_TRUE(shape);
  EXPECT_EQ(shape->objects.at(0).x_m, p.opening.c0_m);
  ExpectNear(shape->objects[0].centre_m, {0, 0.1, p.opening.height_m / 2});
  p.opening = {};
  EXPECT_FALSE(ParseGldfShape(FormatGldf(p, {}, "test", "x.gldf"), "x.gldf"));
}

std::string ArchiveOfFolder(const std::filesystem::path& folder,
                            const std::vector<const char*>& meshes) {
  std::vector<ZipMember> members = {
      {"structure.xml", core::ReadAtMost(folder / "structure.xml", 1 << 20)}};
  for (const char* mesh : meshes)
    members.push_back({mesh, core::ReadAtMost(folder / mesh, 1 << 20)});
  return FormatZip(members);
}

// The examples of L3D's own repository: a cube that shines down, a luminaire with a disc, and one
// of four heads that shine aside. Their meshes' faces look where their objects shine.
TEST(L3d, ExamplesOfOthersShineWhereTheirFacesLook) {
  const auto folder = testdata::Folder() / "l3d";
  LUXFIELD_NEEDS_DATA(folder / "example_000" / "structure.xml");
  const LampShape cube =
      ParseL3d(ArchiveOfFolder(folder / "example_000", {"cube/cube.obj"}), "example_000");
  EXPECT_EQ(cube.objects.at(0).x_m, 0.5);
  EXPECT_NEAR(cube.surfaces.at(0).area_m2, 0.125, 1e-9);
  ExpectNear(cube.surfaces[0].direction, cube.objects[0].direction, 1e-6);

  const LampShape disc =
      ParseL3d(ArchiveOfFolder(folder / "example_003", {"luminaire/luminaire.obj"}), "example_003");
  EXPECT_NEAR(disc.surfaces.at(0).area_m2, std::numbers::pi * 0.01, 2e-4);  // of polygons
  ExpectNear(disc.surfaces[0].direction, disc.objects.at(0).direction, 1e-6);

  const LampShape heads = ParseL3d(
      ArchiveOfFolder(folder / "example_006",
                      {"base/base.obj", "base-head-con/base-head-con.obj", "head/head.obj"}),
      "example_006");
  ASSERT_EQ(heads.objects.size(), 4u);
  ASSERT_EQ(heads.surfaces.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_TRUE(heads.objects[k].round);
    ExpectNear(heads.objects[k].direction, {1, 0, 0}, 1e-9);
    ExpectNear(heads.surfaces[k].direction, heads.objects[k].direction, 1e-6);
    EXPECT_NEAR(heads.surfaces[k].area_m2, std::numbers::pi * 0.0025, 3e-5);
    ExpectNear(heads.objects[k].centre_m, {0.045, 0.55 - 0.4 * double(k) + 0.043, 0.145}, 1e-9);
  }
}

TEST(L3d, ContainersOfOthersAreRead) {
  const auto whole = testdata::Folder() / "gldf" / "netests__GldfWithFilesComplete.gldf";
  LUXFIELD_NEEDS_DATA(whole);
  const auto shape = ReadLampShape(whole);
  ASSERT_TRUE(shape);
  // Turned by 90 degrees with its part, and back by itself.
  EXPECT_EQ(shape->objects.at(0).x_m, 0.17);
  EXPECT_EQ(shape->objects[0].y_m, 1.17);
  ExpectNear(shape->objects[0].x_axis, {1, 0, 0});
  ExpectNear(shape->objects[0].direction, {0, 0, 1});
  EXPECT_NEAR(shape->surfaces.at(0).area_m2, 0.17 * 1.17, 1e-3);
  ExpectNear(shape->surfaces[0].direction, {0, 0, 1}, 1e-6);
  EXPECT_FALSE(
      ReadLampShape(testdata::Folder() / "gldf" / "netests__GldfWithHeaderMandatory.gldf"));
}

}  // namespace
}  // namespace luxfield::formats
