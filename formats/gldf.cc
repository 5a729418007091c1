#include "luxfield/formats/gldf.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/printable.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/l3d.h"
#include "luxfield/formats/photometric_file.h"
#include "luxfield/formats/xml.h"
#include "luxfield/formats/zip.h"

namespace luxfield::formats {
namespace {

using lightfield::Vec3;

constexpr const char* kProduct = "product.xml";

// What product.xml says of a shape.
constexpr const char* kShapeFile =
    "\n      "
    R"(<File id="shape" contentType="geo/l3d" type="localFileName">lamp.l3d</File>)";
constexpr const char* kShapeGeometry = R"(
    <Geometries>
      <ModelGeometry id="geometry">
        <GeometryFileReference fileId="shape"/>
      </ModelGeometry>
    </Geometries>)";
constexpr const char* kShapeReference =
    R"(          <ModelGeometryReference geometryId="geometry">
            <EmitterReference emitterId="emitter">
              <EmitterObjectExternalName>{}</EmitterObjectExternalName>
            </EmitterReference>
          </ModelGeometryReference>)";
constexpr const char* kNoShapeReference = R"(          <EmitterReference emitterId="emitter"/>)";

XmlElement ReadProduct(const ZipReader& zip, const std::string& file) {
  XmlElement root = ParseXml(zip.Read(kProduct), fmt::format("{}: {}", file, kProduct));
  if (root.name != "Root")
    throw InputError(file,
                     fmt::format("the element <{}> of its product.xml is not GLDF's <Root>",
                                 core::Printable(root.name)),
                     "name a GLDF file");
  return root;
}

// The file that a reference names, or none.
const XmlElement* FileOf(const XmlElement& root, const XmlElement& reference) {
  const XmlElement* files = root.at({"GeneralDefinitions", "Files"});
  if (!files) return nullptr;
  const std::string id = reference.attribute("fileId");
  for (const XmlElement& one : files->children)
    if (one.attribute("id") == id) return &one;
  return nullptr;
}

// 12345678-1234-1234-1234-123456789abc of a hash.
std::string Identifier(const std::string& hex) {
  return fmt::format("{}-{}-{}-{}-{}", hex.substr(0, 8), hex.substr(8, 4), hex.substr(12, 4),
                     hex.substr(16, 4), hex.substr(20, 12));
}

std::string Stated(const Photometry& p, const char* key) {
  const std::string text = p.keyword(key);
  return XmlEscaped(text.empty() ? "not stated" : text);
}

}  // namespace

Photometry ParseGldf(std::string_view bytes, const std::string& file) {
  const ZipReader zip(bytes, file);
  const XmlElement root = ReadProduct(zip, file);
  const XmlElement* photometries = root.at({"GeneralDefinitions", "Photometries"});
  std::vector<std::string> members;
  std::string elsewhere;
  if (photometries)
    for (const XmlElement& photometry : photometries->children) {
      const XmlElement* reference = photometry.child("PhotometryFileReference");
      const XmlElement* one = reference ? FileOf(root, *reference) : nullptr;
      if (!one) continue;
      if (one->attribute("type") == "url")
        elsewhere = one->text;
      else
        members.push_back("ldc/" + one->text);
    }
  if (members.empty())
    throw InputError(file,
                     elsewhere.empty() ? "its product.xml names no photometry"
                                       : fmt::format("its photometry lies elsewhere, at {}",
                                                     core::Printable(elsewhere)),
                     "have it exported with its photometry inside");
  Photometry p =
      ParsePhotometry(zip.Read(members.front()), fmt::format("{}: {}", file, members.front()));
  p.format = fmt::format("GLDF, {}", p.format);
  if (members.size() > 1)
    p.odd.push_back(fmt::format("it has {} photometries; the first is taken, {}", members.size(),
                                core::Printable(members.front())));
  return p;
}

std::optional<LampShape> ParseGldfShape(std::string_view bytes, const std::string& file) {
  const ZipReader zip(bytes, file);
  const XmlElement root = ReadProduct(zip, file);
  const XmlElement* geometries = root.at({"GeneralDefinitions", "Geometries"});
  if (!geometries) return {};
  for (const XmlElement& geometry : geometries->children)
    for (const XmlElement& reference : geometry.children) {
      const XmlElement* one =
          reference.name == "GeometryFileReference" ? FileOf(root, reference) : nullptr;
      if (!one || one->attribute("contentType") != "geo/l3d" || one->attribute("type") == "url")
        continue;
      const std::string member = "geo/" + one->text;
      return ParseL3d(zip.Read(member), fmt::format("{}: {}", file, core::Printable(member)));
    }
  return {};
}

std::string FormatGldf(const Photometry& p, Vec3 middle_m, const std::string& creator,
                       const std::string& file) {
  const std::string ldt = FormatEulumdat(p, file);
  const std::optional<std::string> l3d = FormatL3d(p.opening, middle_m, creator);
  const std::string id = Identifier(core::Sha256(ldt));
  const std::string name = Stated(p, "LUMINAIRE");
  const std::string product = fmt::format(
      R"(<?xml version="1.0" encoding="utf-8"?>
<Root xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="https://gldf.io/xsd/gldf/1.0.0-rc.3/gldf.xsd">
  <Header>
    <Manufacturer>{0}</Manufacturer>
    <FormatVersion major="1" minor="0" pre-release="3"/>
    <CreatedWithApplication>{1}</CreatedWithApplication>
    <GldfCreationTimeCode>0001-01-01T00:00:00Z</GldfCreationTimeCode>
    <UniqueGldfId>{2}</UniqueGldfId>
  </Header>
  <GeneralDefinitions>
    <Files>
      <File id="file" contentType="ldc/eulumdat" type="localFileName">lamp.ldt</File>{5}
    </Files>
    <Photometries>
      <Photometry id="photometry">
        <PhotometryFileReference fileId="file"/>
      </Photometry>
    </Photometries>
    <Emitters>
      <Emitter id="emitter">
        <ChangeableLightEmitter>
          <PhotometryReference photometryId="photometry"/>
        </ChangeableLightEmitter>
      </Emitter>
    </Emitters>{6}
  </GeneralDefinitions>
  <ProductDefinitions>
    <ProductMetaData>
      <UniqueProductId>{2}</UniqueProductId>
      <ProductNumber>
        <Locale language="en">{3}</Locale>
      </ProductNumber>
      <Name>
        <Locale language="en">{4}</Locale>
      </Name>
    </ProductMetaData>
    <Variants>
      <Variant id="variant">
        <Name>
          <Locale language="en">{4}</Locale>
        </Name>
        <Geometry>
{7}
        </Geometry>
      </Variant>
    </Variants>
  </ProductDefinitions>
</Root>
)",
      Stated(p, "MANUFAC"), XmlEscaped(creator), id, Stated(p, "LUMCAT"), name,
      l3d ? kShapeFile : "", l3d ? kShapeGeometry : "",
      l3d ? fmt::format(kShapeReference, kEmittingObject) : kNoShapeReference);
  std::vector<ZipMember> members = {{kProduct, product}, {"ldc/lamp.ldt", ldt}};
  if (l3d) members.push_back({"geo/lamp.l3d", *l3d});
  return FormatZip(members);
}

}  // namespace luxfield::formats
