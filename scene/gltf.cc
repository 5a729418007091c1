#include "luxfield/scene/gltf.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

namespace luxfield::scene {
namespace {

using core::Field;
using core::Json;

constexpr char kRemedy[] = "repair the mesh or export it again";

std::uint32_t LittleEndian32(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k)
    value |= std::uint32_t{static_cast<unsigned char>(bytes[at + k])} << (8 * k);
  return value;
}

// RFC 4648; empty if the text is none.
std::optional<std::string> DecodeBase64(std::string_view text) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const auto digit = kDigits.find(c);
    if (digit == std::string_view::npos) return {};
    bits = (bits << 6) | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<char>((bits >> count) & 255u));
  }
  return bytes;
}

// "%20" and the like of a relative reference, RFC 3986, 2.1.
std::string DecodePercent(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto is_hex = [&](std::size_t k) {
      return k < text.size() && std::isxdigit(static_cast<unsigned char>(text[k]));
    };
    if (text[i] == '%' && is_hex(i + 1) && is_hex(i + 2)) {
      out.push_back(static_cast<char>(std::stoi(text.substr(i + 1, 2), nullptr, 16)));
      i += 2;
    } else {
      out.push_back(text[i] == '\\' ? '/' : text[i]);
    }
  }
  return out;
}

struct ComponentType {
  std::size_t bytes;
  double largest;  // of normalised integers; 0: numbers as they are
};

std::optional<ComponentType> ComponentTypeOf(int code) {
  switch (code) {
    case 5120:
      return ComponentType{1, 127};
    case 5121:
      return ComponentType{1, 255};
    case 5122:
      return ComponentType{2, 32767};
    case 5123:
      return ComponentType{2, 65535};
    case 5126:
      return ComponentType{4, 0};
    default:
      return {};
  }
}

double Component(const unsigned char* bytes, int code) {
  const auto read = [&](auto value) {
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
  };
  switch (code) {
    case 5120:
      return read(std::int8_t{});
    case 5121:
      return read(std::uint8_t{});
    case 5122:
      return read(std::int16_t{});
    case 5123:
      return read(std::uint16_t{});
    default:
      return read(0.0f);
  }
}

// Of a unit quaternion x, y, z, w.
Transform Rotation(const std::array<double, 4>& q) {
  const auto [x, y, z, w] = q;
  return {{{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
            {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
            {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}},
          {}};
}

}  // namespace

const Json* Extension(const Json& json, const std::string& name) {
  if (!json.is_object()) return nullptr;
  const auto extensions = json.find("extensions");
  if (extensions == json.end() || !extensions->is_object()) return nullptr;
  const auto extension = extensions->find(name);
  return extension == extensions->end() ? nullptr : &*extension;
}

bool Gltf::Is(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension == ".gltf" || extension == ".glb";
}

void Gltf::Fail(const std::string& problem) const { throw InputError(file(), problem, kRemedy); }

Gltf::Gltf(const std::filesystem::path& path) : path_(path) {
  std::string bytes = core::ReadFile(path);
  // glTF 2.0, 4.4: a header of 12 bytes, chunks of length, type and content.
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  if (bytes.starts_with("glTF")) {
    std::size_t at = kHeader;
    const auto next = [&](std::string_view type) -> std::string {
      if (at + kChunkHeader > bytes.size() || bytes.compare(at + 4, 4, type) != 0) return {};
      const std::size_t length = LittleEndian32(bytes, at);
      if (length > bytes.size() - at - kChunkHeader) Fail("the file is cut off");
      std::string content = bytes.substr(at + kChunkHeader, length);
      at += kChunkHeader + (length + 3) / 4 * 4;
      return content;
    };
    const std::string text = next("JSON");
    glb_buffer_ = next(std::string_view("BIN\0", 4));
    bytes = text;
  }
  json_ = core::ParseJson(bytes, file());
  const Json asset = FieldOr<Json>(json_, "asset", Json::object(), file());
  if (const auto version = FieldOr<std::string>(asset, "version", "", file());
      !version.starts_with("2."))
    Fail(fmt::format("is glTF of version '{}'; only 2.0 is read", version));
  for (const char* packing :
       {"KHR_mesh_quantization", "EXT_meshopt_compression", "KHR_meshopt_compression"}) {
    const auto used = FieldOr<std::vector<std::string>>(json_, "extensionsUsed", {}, file());
    if (std::find(used.begin(), used.end(), packing) != used.end())
      throw InputError(file(), fmt::format("packs its vertices by {}, which is not read", packing),
                       "export it without compression and quantisation");
  }
  CheckNodes();
}

const Json& Gltf::Element(const std::string& list, std::size_t index) const {
  const auto found = json_.find(list);
  if (found == json_.end() || !found->is_array() || index >= found->size() ||
      !(*found)[index].is_object())
    Fail(fmt::format("refers to {}[{}], which it does not contain", list, index));
  return (*found)[index];
}

std::vector<std::size_t> Gltf::RootNodes() const {
  if (!json_.contains("scenes")) return {};
  const Json& scene = Element("scenes", FieldOr<std::size_t>(json_, "scene", 0, file()));
  return FieldOr<std::vector<std::size_t>>(scene, "nodes", {}, file());
}

std::vector<std::size_t> Gltf::Children(const Json& node, const std::string& file) {
  return FieldOr<std::vector<std::size_t>>(node, "children", {}, file);
}

// Every node has one parent at most (glTF 2.0, 3.5.2), so that counting them finds loops.
void Gltf::CheckNodes() const {
  std::size_t visited = 0;
  const std::size_t nodes = json_.contains("nodes") ? json_["nodes"].size() : 0;
  std::vector<std::size_t> level = RootNodes();
  for (int depth = 0; !level.empty(); ++depth) {
    if (depth > kDeepestNodes)
      Fail(fmt::format("nests its nodes more than {} deep", kDeepestNodes));
    visited += level.size();
    if (visited > nodes) Fail("names a node twice in its tree of nodes");
    std::vector<std::size_t> below;
    for (const std::size_t node : level)
      for (const std::size_t child : Children(Element("nodes", node), file()))
        below.push_back(child);
    level = std::move(below);
  }
}

std::string Gltf::Resource(const std::string& uri) const {
  if (uri.starts_with("data:")) {
    const auto comma = uri.find(";base64,");
    const auto bytes = comma == std::string::npos ? std::optional<std::string>()
                                                  : DecodeBase64(uri.substr(comma + 8));
    if (!bytes) Fail("holds a data URI that is not base64");
    return *bytes;
  }
  const std::filesystem::path relative = DecodePercent(uri);
  if (relative.is_absolute() || uri.find("://") != std::string::npos)
    Fail(fmt::format("refers to '{}'; only files beside it are read", uri));
  return core::ReadFile(path_.parent_path() / relative);
}

std::uintmax_t Gltf::Bytes() const {
  std::error_code error;
  std::uintmax_t bytes = std::filesystem::file_size(path_, error);
  const std::size_t buffers = json_.contains("buffers") ? json_["buffers"].size() : 0;
  for (std::size_t i = 0; i < buffers; ++i) {
    const auto uri = FieldOr<std::string>(Element("buffers", i), "uri", "", file());
    if (uri.empty() || uri.starts_with("data:")) continue;
    const auto beside = std::filesystem::file_size(path_.parent_path() / DecodePercent(uri), error);
    if (!error) bytes += beside;
  }
  return bytes;
}

const std::string& Gltf::Buffer(std::size_t buffer) const {
  const Json& of = Element("buffers", buffer);
  if (!of.contains("uri")) return glb_buffer_;
  const auto [entry, is_new] = buffers_.try_emplace(buffer);
  if (is_new) entry->second = Resource(Field<std::string>(of, "uri", file()));
  return entry->second;
}

std::span<const unsigned char> Gltf::BufferView(std::size_t view) const {
  const Json& of = Element("bufferViews", view);
  const std::string& buffer = Buffer(Field<std::size_t>(of, "buffer", file()));
  const auto offset = FieldOr<std::size_t>(of, "byteOffset", 0, file()),
             length = Field<std::size_t>(of, "byteLength", file());
  if (offset > buffer.size() || length > buffer.size() - offset)
    Fail(fmt::format("bufferViews[{}] ends beyond its buffer", view));
  return {reinterpret_cast<const unsigned char*>(buffer.data()) + offset, length};
}

std::vector<std::array<double, 4>> Gltf::Values(std::size_t accessor, int components) const {
  const Json& of = Element("accessors", accessor);
  const auto code = Field<int>(of, "componentType", file());
  const auto type = ComponentTypeOf(code);
  const auto shape = Field<std::string>(of, "type", file());
  if (!type || shape != fmt::format("VEC{}", components))
    Fail(fmt::format("accessors[{}] is {} of component type {} where {} numbers each belong",
                     accessor, shape, code, components));
  if (of.contains("sparse") || !of.contains("bufferView"))
    Fail(fmt::format("accessors[{}] is sparse, which is read of vertices alone", accessor));
  const auto view = Field<std::size_t>(of, "bufferView", file());
  const auto bytes = BufferView(view);
  const std::size_t element = type->bytes * static_cast<std::size_t>(components);
  const auto count = Field<std::size_t>(of, "count", file()),
             offset = FieldOr<std::size_t>(of, "byteOffset", 0, file()),
             stride =
                 FieldOr<std::size_t>(Element("bufferViews", view), "byteStride", element, file());
  if (stride < element || count > bytes.size() || offset > bytes.size() ||
      (count > 0 && (count - 1) * stride + element > bytes.size() - offset))
    Fail(fmt::format("accessors[{}] ends beyond its bufferViews[{}]", accessor, view));
  const bool normalised = FieldOr<bool>(of, "normalized", false, file()) && type->largest > 0;
  std::vector<std::array<double, 4>> values(count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < static_cast<std::size_t>(components); ++k) {
      const double value = Component(&bytes[offset + i * stride + k * type->bytes], code);
      if (!std::isfinite(value))
        Fail(fmt::format("accessors[{}] holds a number that is not finite", accessor));
      values[i][k] = normalised ? std::max(value / type->largest, -1.0) : value;
    }
  return values;
}

std::vector<Transform> Gltf::Instances(const Json& node) const {
  const Json* instancing = Extension(node, "EXT_mesh_gpu_instancing");
  if (!instancing) return {{}};
  const Json attributes = Field<Json>(*instancing, "attributes", file());
  std::optional<std::size_t> count;
  const auto read = [&](const std::string& name, int components) {
    std::vector<std::array<double, 4>> values;
    if (!attributes.contains(name)) return values;
    values = Values(Field<std::size_t>(attributes, name, file()), components);
    if (count.value_or(values.size()) != values.size())
      Fail(fmt::format("EXT_mesh_gpu_instancing has {} values of {} where others have {}",
                       values.size(), name, *count));
    count = values.size();
    return values;
  };
  const auto translations = read("TRANSLATION", 3), rotations = read("ROTATION", 4),
             scales = read("SCALE", 3);
  if (!count) return {{}};
  std::vector<Transform> instances(*count);
  for (std::size_t i = 0; i < *count; ++i) {
    if (!translations.empty())
      instances[i] = Translation({translations[i][0], translations[i][1], translations[i][2]});
    if (!rotations.empty()) {
      std::array<double, 4> q = rotations[i];
      const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
      if (!(length > 0)) Fail(fmt::format("instance {} is rotated by a quaternion of zeros", i));
      for (double& x : q) x /= length;  // integers are rounded
      instances[i] = instances[i] * Rotation(q);
    }
    if (!scales.empty())
      instances[i] = instances[i] * Scaling({scales[i][0], scales[i][1], scales[i][2]});
  }
  return instances;
}

Texture Gltf::Image(std::size_t image, Alpha alpha) const {
  const Json& of = Element("images", image);
  const auto decode = [&](std::span<const unsigned char> bytes, const std::string& name) {
    return DecodeTexture(bytes, name, alpha);
  };
  const auto embedded = fmt::format("{}, images[{}]", file(), image);
  if (!of.contains("uri"))
    return decode(BufferView(Field<std::size_t>(of, "bufferView", file())), embedded);
  const auto uri = Field<std::string>(of, "uri", file());
  const std::string bytes = Resource(uri);
  return decode(
      {reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()},
      uri.starts_with("data:") ? embedded : (path_.parent_path() / DecodePercent(uri)).string());
}

}  // namespace luxfield::scene
