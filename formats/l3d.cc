#include "luxfield/formats/l3d.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"
#include "luxfield/formats/obj_faces.h"
#include "luxfield/formats/text_reader.h"
#include "luxfield/formats/xml.h"
#include "luxfield/formats/zip.h"
#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::formats {
namespace {

using lightfield::RigidPose;
using lightfield::Vec3;

constexpr const char* kStructure = "structure.xml";
constexpr double kMostNumber = 1e6;
// From the luminaire's frame to L3D's, and back.
constexpr RigidPose kTurnedOver{{1, 0, 0, 0, -1, 0, 0, 0, -1}, {}};

double MetresOf(const std::string& unit) {
  for (const auto& [name, metres] :
       {std::pair{"m", 1.0}, std::pair{"dm", 0.1}, std::pair{"cm", 0.01}, std::pair{"mm", 1e-3},
        std::pair{"yard", 0.9144}, std::pair{"foot", 0.3048}, std::pair{"inch", 0.0254}})
    if (unit == name) return metres;
  return 0;
}

// About z, then x, then y of the part itself, degrees.
RigidPose Turned(Vec3 degrees) {
  const auto about = [](int axis, double angle) {
    const double c = std::cos(angle * std::numbers::pi / 180),
                 s = std::sin(angle * std::numbers::pi / 180);
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    RigidPose pose;
    pose.rotation[std::size_t(a * 3 + a)] = pose.rotation[std::size_t(b * 3 + b)] = c;
    pose.rotation[std::size_t(a * 3 + b)] = -s;
    pose.rotation[std::size_t(b * 3 + a)] = s;
    return pose;
  };
  return about(2, degrees.z) * about(0, degrees.x) * about(1, degrees.y);
}

class L3dReader {
 public:
  L3dReader(std::string_view bytes, const std::string& file)
      : zip_(bytes, file), file_(fmt::format("{}: {}", file, kStructure)) {}

  LampShape Read() {
    const XmlElement root = ParseXml(zip_.Read(kStructure), file_);
    if (root.name != "Luminaire")
      Fail(root, fmt::format("<{}> is not L3D's <Luminaire>", core::Printable(root.name)));
    if (const XmlElement* definitions = root.child("GeometryDefinitions"))
      for (const XmlElement& definition : definitions->children)
        definitions_.emplace(definition.attribute("id"), &definition);
    const XmlElement* structure = root.child("Structure");
    if (!structure) Fail(root, "has no <Structure>");
    ReadParts(*structure, kTurnedOver);
    return std::move(shape_);
  }

 private:
  [[noreturn]] void Fail(const XmlElement& at, const std::string& problem) const {
    throw InputError(file_, fmt::format("line {}: {}", at.line, problem), "have it exported anew");
  }

  template <typename T>
  T Number(const XmlElement& element, const char* name, std::optional<T> if_absent = {}) const {
    const std::string text = element.attribute(name);
    if (text.empty() && if_absent) return *if_absent;
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() ||
        !(std::abs(static_cast<double>(value)) <= kMostNumber))
      Fail(element, fmt::format("{} = '{}' of <{}> is no number up to 1e6", name,
                                core::Printable(text), core::Printable(element.name)));
    return value;
  }

  double Extent(const XmlElement& element, const char* name) const {
    const double extent = Number<double>(element, name);
    if (!(extent > 0)) Fail(element, fmt::format("{} = {} is not above 0", name, extent));
    return extent;
  }

  Vec3 Vector(const XmlElement& element, const char* name) const {
    const XmlElement* vector = element.child(name);
    if (!vector) return {};
    return {Number<double>(*vector, "x"), Number<double>(*vector, "y"),
            Number<double>(*vector, "z")};
  }

  RigidPose PoseOf(const XmlElement& part) const {
    RigidPose pose = Turned(Vector(part, "Rotation"));
    pose.translation_m = Vector(part, "Position");
    return pose;
  }

  void ReadParts(const XmlElement& parent, const RigidPose& luminaire_from_parent) {
    for (const XmlElement& part : parent.children)
      if (part.name == "Geometry") ReadPart(part, luminaire_from_parent * PoseOf(part));
  }

  void ReadPart(const XmlElement& part, const RigidPose& luminaire_from_part) {
    if (const XmlElement* objects = part.child("LightEmittingObjects"))
      for (const XmlElement& object : objects->children) AddObject(object, luminaire_from_part);
    if (const XmlElement* surfaces = part.child("LightEmittingSurfaces"))
      for (const XmlElement& surface : surfaces->children)
        AddSurface(surface, part, luminaire_from_part);
    if (part.child("LightEmittingFaceAssignments"))
      shape_.odd.push_back("its shining faces are assigned as before L3D 0.9 and are not read");
    if (const XmlElement* joints = part.child("Joints"))
      for (const XmlElement& joint : joints->children)
        if (const XmlElement* parts = joint.child("Geometries"))
          ReadParts(*parts,
                    luminaire_from_part * PoseOf(joint) * Turned(Vector(joint, "DefaultRotation")));
  }

  void AddObject(const XmlElement& element, const RigidPose& luminaire_from_part) {
    EmittingObject object;
    object.name = element.attribute("partName");
    const XmlElement* circle = element.child("Circle");
    const XmlElement* rectangle = element.child("Rectangle");
    if (!circle && !rectangle) Fail(element, "a light-emitting object has neither shape");
    object.round = circle;
    object.x_m = circle ? Extent(*circle, "diameter") : Extent(*rectangle, "sizeX");
    object.y_m = circle ? object.x_m : Extent(*rectangle, "sizeY");
    if (const XmlElement* heights = element.child("LuminousHeights"))
      object.heights_m = {Number<double>(*heights, "c0"), Number<double>(*heights, "c90"),
                          Number<double>(*heights, "c180"), Number<double>(*heights, "c270")};
    const RigidPose pose = luminaire_from_part * PoseOf(element);
    object.centre_m = pose.translation_m;
    object.x_axis = pose.Direction({1, 0, 0});
    object.direction = pose.Direction({0, 0, -1});
    shape_.objects.push_back(std::move(object));
  }

  void AddSurface(const XmlElement& element, const XmlElement& part,
                  const RigidPose& luminaire_from_part) {
    EmittingSurface surface;
    surface.name = element.attribute("partName");
    for (const XmlElement& child : element.children)
      if (child.name == "LightEmittingObjectReference")
        surface.objects.push_back(child.attribute("lightEmittingPartName"));
    const XmlElement* assignments = element.child("FaceAssignments");
    const XmlElement* reference = part.child("GeometryReference");
    if (!assignments || !reference)
      Fail(element, "a light-emitting surface has no faces or no geometry");
    const Mesh& mesh = MeshOf(*reference);
    Vec3 normal;
    for (const XmlElement& assignment : assignments->children) {
      const auto group = Number<int>(assignment, "groupIndex", 0);
      const bool one = assignment.name == "FaceAssignment";
      const auto first = Number<int>(assignment, one ? "faceIndex" : "faceIndexBegin");
      const auto last = one ? first : Number<int>(assignment, "faceIndexEnd");
      if (group < 0 || group >= static_cast<int>(mesh.groups.size()) || first < 0 || last < first ||
          last >= static_cast<int>(mesh.groups[std::size_t(group)].faces()))
        Fail(assignment,
             fmt::format("its mesh has no faces {} to {} in group {}", first, last, group));
      const FaceGroup& faces = mesh.groups[std::size_t(group)];
      const auto from = std::size_t(first), to = std::size_t(last) + 1;
      surface.faces += to - from;
      surface.area_m2 += mesh.square_metres * (faces.area_up_to[to] - faces.area_up_to[from]);
      normal = normal + mesh.square_metres * (faces.normal_up_to[to] - faces.normal_up_to[from]);
    }
    if (surface.area_m2 > 0)
      surface.direction = luminaire_from_part.Direction((1 / surface.area_m2) * normal);
    shape_.surfaces.push_back(std::move(surface));
  }

  struct Mesh {
    std::vector<FaceGroup> groups;
    double square_metres = 1;  // of a square unit
  };

  const Mesh& MeshOf(const XmlElement& reference) {
    const std::string id = reference.attribute("geometryId");
    if (const auto known = meshes_.find(id); known != meshes_.end()) return known->second;
    const auto definition = definitions_.find(id);
    if (definition == definitions_.end())
      Fail(reference, fmt::format("no geometry '{}' is defined", core::Printable(id)));
    const double metres = MetresOf(definition->second->attribute("units"));
    if (metres == 0)
      Fail(*definition->second,
           fmt::format("units '{}' are not known",
                       core::Printable(definition->second->attribute("units"))));
    const std::string member = fmt::format("{}/{}", id, definition->second->attribute("filename"));
    const std::string text = zip_.Read(member);
    unpacked_ += text.size();
    if (unpacked_ > kMostText) Fail(reference, "the meshes have more than 64 MiB together");
    const Mesh mesh{ParseObjFaces(text, fmt::format("{}: {}", file_, core::Printable(member))),
                    metres * metres};
    return meshes_.emplace(id, mesh).first->second;
  }

  ZipReader zip_;
  std::string file_;
  std::map<std::string, const XmlElement*> definitions_;
  std::map<std::string, Mesh> meshes_;
  std::size_t unpacked_ = 0;
  LampShape shape_;
};

// Vertices in L3D's frame about the opening's middle, and faces of them, shining ones first.
struct ObjMesh {
  std::string vertices, faces;
  int count = 0, shining = 0;

  int Add(double x, double y, double z) {
    vertices += fmt::format("v {:.9g} {:.9g} {:.9g}\n", x, y, z);
    return ++count;
  }
};

// The bottom, counterclockwise for one who looks up at it, and with height sides and top.
ObjMesh MeshOf(const std::vector<std::pair<double, double>>& outline, double height) {
  ObjMesh mesh;
  const int corners = static_cast<int>(outline.size());
  for (const double z : height > 0 ? std::vector{0.0, height} : std::vector{0.0})
    for (const auto& [x, y] : outline) mesh.Add(x, y, z);
  mesh.faces += "f";
  for (int k = corners; k >= 1; --k) mesh.faces += fmt::format(" {}", k);
  mesh.faces += "\n";
  mesh.shining = 1;
  if (!(height > 0)) return mesh;
  for (int k = 1; k <= corners; ++k) {
    const int next = k % corners + 1;
    mesh.faces += fmt::format("f {} {} {} {}\n", k, next, next + corners, k + corners);
  }
  mesh.shining += corners;
  mesh.faces += "f";
  for (int k = 1; k <= corners; ++k) mesh.faces += fmt::format(" {}", k + corners);
  mesh.faces += "\n";
  return mesh;
}

std::vector<std::pair<double, double>> OutlineOf(const Opening& opening) {
  const double x = opening.c0_m / 2, y = opening.c90_m / 2;
  if (opening.shape == Opening::Shape::kBox) return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
  constexpr int kCorners = 64;
  std::vector<std::pair<double, double>> outline;
  for (int k = 0; k < kCorners; ++k) {
    const double turn = 2 * std::numbers::pi * k / kCorners;
    outline.emplace_back(x * std::cos(turn), y * std::sin(turn));
  }
  return outline;
}

}  // namespace

LampShape ParseL3d(std::string_view bytes, const std::string& file) {
  return L3dReader(bytes, file).Read();
}

std::optional<std::string> FormatL3d(const Opening& opening, Vec3 middle_m,
                                     const std::string& creator) {
  const bool round = opening.shape == Opening::Shape::kEllipse && opening.c0_m == opening.c90_m;
  if (!(round || opening.shape == Opening::Shape::kBox) || !(opening.c0_m > 0 && opening.c90_m > 0))
    return {};
  const ObjMesh mesh = MeshOf(OutlineOf(opening), opening.height_m);
  const Vec3 bottom = middle_m + Vec3{0, 0, opening.height_m / 2};
  const std::string shape = round ? fmt::format(R"(<Circle diameter="{:.9g}"/>)", opening.c0_m)
                                  : fmt::format(R"(<Rectangle sizeX="{:.9g}" sizeY="{:.9g}"/>)",
                                                opening.c0_m, opening.c90_m);
  const std::string heights =
      opening.height_m > 0
          ? fmt::format(
                "\n            "
                R"(<LuminousHeights c0="{0:.9g}" c90="{0:.9g}" c180="{0:.9g}" c270="{0:.9g}"/>)",
                opening.height_m)
          : "";
  const std::string faces =
      mesh.shining == 1
          ? R"(<FaceAssignment faceIndex="0"/>)"
          : fmt::format(R"(<FaceRangeAssignment faceIndexBegin="0" faceIndexEnd="{}"/>)",
                        mesh.shining - 1);
  const std::string structure = fmt::format(
      R"(<?xml version="1.0" encoding="utf-8"?>
<Luminaire xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="https://gldf.io/xsd/l3d/0.11.0/l3d.xsd">
  <Header>
    <CreatedWithApplication>{0}</CreatedWithApplication>
    <CreationTimeCode>0001-01-01T00:00:00</CreationTimeCode>
    <FormatVersion major="0" minor="11"/>
  </Header>
  <GeometryDefinitions>
    <GeometryFileDefinition id="lamp" filename="lamp.obj" units="m"/>
  </GeometryDefinitions>
  <Structure>
    <Geometry partName="luminaire">
      <Position x="{1:.9g}" y="{2:.9g}" z="{3:.9g}"/>
      <Rotation x="0" y="0" z="0"/>
      <GeometryReference geometryId="lamp"/>
      <LightEmittingObjects>
        <LightEmittingObject partName="{4}">
          <Position x="0" y="0" z="0"/>
          <Rotation x="0" y="0" z="0"/>
          {5}{6}
        </LightEmittingObject>
      </LightEmittingObjects>
      <LightEmittingSurfaces>
        <LightEmittingSurface partName="surface">
          <LightEmittingObjectReference lightEmittingPartName="{4}"/>
          <FaceAssignments>
            {7}
          </FaceAssignments>
        </LightEmittingSurface>
      </LightEmittingSurfaces>
    </Geometry>
  </Structure>
</Luminaire>
)",
      XmlEscaped(creator), bottom.x, 0 - bottom.y, 0 - bottom.z, kEmittingObject, shape, heights,
      faces);
  return FormatZip({{kStructure, structure}, {"lamp/lamp.obj", mesh.vertices + mesh.faces}});
}

}  // namespace luxfield::formats
