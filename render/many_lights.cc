#include "luxfield/render/many_lights.h"

#include <algorithm>
#include <numeric>

#include "luxfield/core/stopwatch.h"
#include "luxfield/render/estimators/sampling_params.h"

namespace luxfield::render {
namespace {

// Draws that lie in memory at a time, some 180 bytes each.
constexpr std::size_t kMostDraws = std::size_t{1} << 18;
constexpr std::size_t kLeastPoints = 64;

LightTree MakeTree(const Device& device, std::span<const DrawnLight> lights,
                   std::span<const BoundedTable> tables) {
  std::vector<BoundedLight> bounds;
  for (const DrawnLight& light : lights) bounds.push_back(light.bounds);
  return UploadLightTree(device, bounds, tables);
}

// Whether one launch can light with both.
bool FitTogether(const LightSource& a, const LightSource& b) {
  if (a.index() != b.index()) return false;
  if (const auto* luminaire = std::get_if<PosedLuminaire>(&a))
    return &luminaire->luminaire == &std::get<PosedLuminaire>(b).luminaire;
  using ClassicalLight = std::reference_wrapper<const ClassicalLightSource>;
  if (const auto* classical = std::get_if<ClassicalLight>(&a)) {
    const ClassicalLightSource &one = *classical, &other = std::get<ClassicalLight>(b);
    return one.distribution == other.distribution && IsArea(one) == IsArea(other);
  }
  using AreaLight = std::reference_wrapper<const AreaLightSource>;
  return std::get<AreaLight>(a).get().kind == std::get<AreaLight>(b).get().kind;
}

}  // namespace

ManyLights::ManyLights(FilmKernels& film_kernels, std::vector<DrawnLight> lights,
                       std::span<const BoundedTable> tables)
    : film_kernels_(film_kernels),
      lights_(std::move(lights)),
      tree_(MakeTree(film_kernels.device, lights_, tables)),
      select_(Program::Build(film_kernels.device, "kernels/lights/select_lights.cl"),
              "SelectLights") {
  Sort();
}

void ManyLights::Sort() {
  for (const DrawnLight& light : lights_) {
    const auto takes = [&](const Launch& launch) {
      return launch.estimator == light.estimator &&
             launch.visibility.rays == light.visibility.rays &&
             launch.visibility.maps == light.visibility.maps &&
             launch.visibility.patches == light.visibility.patches &&
             launch.sources.size() < LightTasks::kMostLights &&
             FitTogether(launch.sources.front(), light.source);
    };
    auto launch = std::find_if(launches_.begin(), launches_.end(), takes);
    if (launch == launches_.end())
      launch = launches_.insert(launch, Launch{light.estimator, light.visibility, {}});
    places_.push_back({static_cast<std::size_t>(launch - launches_.begin()),
                       static_cast<int>(launch->sources.size())});
    launch->sources.push_back(light.source);
  }
  order_.resize(lights_.size());
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
    return places_[a].launch < places_[b].launch;
  });
}

ManyLights::Drawn ManyLights::Draw(const GBuffer& gbuffer, const EstimatorOptions& options,
                                   std::size_t first, std::size_t end) {
  const std::size_t capacity = std::min<std::size_t>(options.samples_per_pixel, lights_.size()),
                    points = end - first;
  SamplingParams sampling = MakeSamplingParams(options);
  sampling.begin = static_cast<int>(first);
  sampling.end = static_cast<int>(end);
  const Device& device = film_kernels_.device;
  const Buffer params = Buffer::From(device, std::span<const SamplingParams>(&sampling, 1)),
               device_counts(device, points * sizeof(cl_int)),
               device_selected(device, points * capacity * sizeof(SelectedLight));
  select_
      .Set(tree_.nodes, tree_.lights, tree_.tables, params, gbuffer.position, gbuffer.normal,
           static_cast<cl_int>(capacity), device_counts, device_selected)
      .Enqueue(points);
  const auto counts = device_counts.Download<cl_int>();
  const auto selected = device_selected.Download<SelectedLight>();

  // By launch, then light, then point (counting sort).
  std::vector<std::size_t> next(lights_.size() + 1, 0);  // where each light's draws begin
  for (std::size_t k = 0; k < points; ++k)
    for (int i = 0; i < counts[k]; ++i) ++next[selected[k * capacity + i].light];
  Drawn drawn;
  drawn.first = first;
  drawn.begins.assign(launches_.size() + 1, 0);
  std::size_t sum = 0;
  for (const std::size_t light : order_) {
    const std::size_t count = next[light];
    next[light] = sum;
    sum += count;
    drawn.begins[places_[light].launch + 1] = sum;
  }
  for (std::size_t l = 1; l < drawn.begins.size(); ++l)
    drawn.begins[l] = std::max(drawn.begins[l], drawn.begins[l - 1]);
  drawn.points.resize(sum);
  drawn.tasks.resize(sum);
  drawn.starts.push_back(0);
  for (std::size_t k = 0; k < points; ++k) {
    for (int i = 0; i < counts[k]; ++i) {
      const SelectedLight& draw = selected[k * capacity + i];
      const DrawnLight& light = lights_[draw.light];
      const std::size_t place = next[draw.light]++;
      drawn.points[place] = first + k;
      drawn.tasks[place] = {places_[draw.light].index, draw.samples,
                            options.first_pixel + static_cast<std::uint32_t>(first + k),
                            options.stream + static_cast<std::uint32_t>(light.number)};
      drawn.draws.push_back(
          {static_cast<cl_int>(place),
           static_cast<cl_int>(light.number),
           static_cast<cl_int>(light.group),
           {static_cast<float>(light.scale[0]), static_cast<float>(light.scale[1]),
            static_cast<float>(light.scale[2])},
           draw.weight});
    }
    drawn.starts.push_back(static_cast<cl_int>(drawn.draws.size()));
  }
  return drawn;
}

void ManyLights::LightDrawn(const FilmPart& part, const Drawn& drawn,
                            const EstimatorOptions& options, PassSums& sums,
                            std::span<FilmLight> groups, int passes) {
  if (drawn.draws.empty()) return;
  const GBuffer points = GatherPoints(film_kernels_, part.gbuffer, drawn.points);
  Lighting found(film_kernels_.device, points);
  const Buffer tasks = Buffer::From(film_kernels_.device, drawn.tasks);
  for (std::size_t l = 0; l < launches_.size(); ++l) {
    const Launch& launch = launches_[l];
    if (drawn.begins[l] == drawn.begins[l + 1]) continue;
    launch.estimator->Light(
        {points, launch.visibility},
        LightTasks{launch.sources, &tasks, drawn.begins[l], drawn.begins[l + 1]}, options, found);
  }
  sums.Add(part, {drawn.first, drawn.starts, drawn.draws, found}, groups, passes);
  film_kernels_.device.Finish();
}

void ManyLights::Light(const FilmPart& part, const EstimatorOptions& options, PassSums& sums,
                       std::span<FilmLight> groups, int passes, RenderTimes& times) {
  const std::size_t points = part.gbuffer.pixel_count(),
                    most = std::min<std::size_t>(options.samples_per_pixel, lights_.size()),
                    step = std::max(kMostDraws / most, kLeastPoints);
  for (std::size_t first = 0; first < points; first += step) {
    const core::Stopwatch stopwatch;
    const Drawn drawn = Draw(part.gbuffer, options, first, std::min(first + step, points));
    LightDrawn(part, drawn, options, sums, groups, passes);
    const double wall_s = stopwatch.WallSeconds();
    times.lighting_s += wall_s;
    times.lighting_core_s += stopwatch.CoreSeconds();
    if (times.light_s.empty()) continue;
    for (const LitDraw& draw : drawn.draws)
      times.light_s[draw.light] += wall_s / static_cast<double>(drawn.draws.size());
  }
}

}  // namespace luxfield::render
