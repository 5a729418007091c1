#include "luxfield/shard/render_task.h"

#include <fmt/format.h>

#include <type_traits>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/render/film/film.h"
#include "luxfield/shard/join_exr.h"

namespace luxfield::shard {
namespace {

using core::Field;

template <typename T>
std::string_view BytesOf(const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// Of the triangles, the materials' colours and the textures, from whatever files they were read.
std::string HashOf(const scene::Geometry& geometry) {
  std::string hashes = core::Sha256(BytesOf(geometry.vertices));
  hashes += core::Sha256(BytesOf(geometry.triangles));
  for (const scene::Texture& texture : geometry.textures)
    hashes +=
        fmt::format("{}x{}", texture.width, texture.height) + core::Sha256(BytesOf(texture.rgba));
  for (const scene::Material& material : geometry.materials)
    hashes += fmt::format(
        "{} {} {} {} {} {} {} {} {} {} {} {} {} {} {}", material.name,
        fmt::join(material.albedo, " "), fmt::join(material.specular, " "), material.exponent,
        material.metallic, material.roughness, material.glossiness, material.normal_scale,
        fmt::join(material.emission, " "), static_cast<int>(material.kind), material.texture,
        material.metallic_roughness_texture, material.specular_glossiness_texture,
        material.normal_texture, material.emission_texture);
  return core::Sha256(hashes);
}

std::vector<render::RelitSums> SumsFrom(const core::Json& figures, const std::string& file) {
  std::vector<render::RelitSums> sums;
  for (const core::Json& one : Field<std::vector<core::Json>>(figures, "relit", file))
    sums.push_back({Field<double>(one, "stated", file), Field<double>(one, "measured", file),
                    Field<double>(one, "measured_variance", file)});
  return sums;
}

}  // namespace

scene::Scene RenderTask::Read() const {
  scene::Scene scene = scene::ReadScene(job_.scene, job_.overrides);
  if (job_.options.width > 0) scene.camera.width = job_.options.width;
  if (job_.options.height > 0) scene.camera.height = job_.options.height;
  return scene;
}

int RenderTask::Length() const { return Read().camera.height; }

int RenderTask::Grain() const {
  const scene::Camera camera = Read().camera;
  return render::Renderer::BandRows(camera.width, camera.height);
}

std::vector<std::filesystem::path> RenderTask::Inputs() const {
  const scene::Scene scene = Read();
  std::vector<std::filesystem::path> files{job_.scene};
  for (const scene::Luminaire& luminaire : scene.luminaires) {
    files.push_back(std::filesystem::absolute(luminaire.light_field));
    if (!luminaire.tables.empty()) files.push_back(std::filesystem::absolute(luminaire.tables));
  }
  if (scene.environment) {
    const auto file = std::filesystem::absolute(scene.environment->file);
    if (!std::filesystem::is_regular_file(file))
      throw InputError(job_.scene.string(),
                       "its environment is a sequence of frames, which is not one picture",
                       "make a job of a scene with one environment map");
    files.push_back(file);
  }
  return files;
}

core::Json RenderTask::Whole() const { return {{"geometry", HashOf(Read().geometry)}}; }

core::Json RenderTask::Run(const core::Json& whole, int first, int last,
                           std::span<const std::filesystem::path> files) const {
  const scene::Scene scene = Read();
  if (HashOf(scene.geometry) != Field<std::string>(whole, "geometry", "job.json"))
    throw InputError(job_.scene.string(), "its meshes or textures have changed since the plan",
                     "put them back, or plan the job anew in another folder");
  const render::Device device = render::Device::Open(job_.device, job_.threads);
  render::LitScene lit(device, scene);
  render::Renderer renderer(lit, job_.options);
  const int rows = render::Renderer::BandRows(renderer.width(), renderer.height());
  const render::Frame frame = renderer.RenderBands(first / rows, (last + rows - 1) / rows);
  render::WriteFrameRows(files[0], frame, first, last - first);
  core::Json relit = core::Json::array();
  for (const render::RelitSums& sums : frame.relit)
    relit.push_back({{"stated", sums.stated},
                     {"measured", sums.measured},
                     {"measured_variance", sums.measured_variance}});
  return {{"relit", relit}};
}

void RenderTask::Join(const core::Json&, std::span<const Piece> pieces) const {
  std::vector<std::filesystem::path> files;
  std::vector<render::RelitSums> sums;
  for (const Piece& piece : pieces) {
    files.push_back(piece.files[0]);
    const auto own = SumsFrom(piece.figures, piece.files[0].string());
    sums.insert(sums.end(), own.begin(), own.end());
  }
  const double scale = render::RelitScale(sums);
  JoinExrRows(files, job_.output, core::ExrCompression::kZip,
              [&](int, const std::string& channel, std::span<float> pixels) {
                if (channel != "variance.Y") return;
                for (float& v : pixels) v *= static_cast<float>(scale);
              });
}

}  // namespace luxfield::shard
