#include "luxfield/view/picture/ticks.h"

#include <algorithm>
#include <cmath>

#include "luxfield/render/film/film.h"

namespace luxfield::view {
namespace {

constexpr int kTenths = 10, kHighestRank = 3;

std::vector<Tick> LinearTicks(const render::FalseColourScale& scale) {
  std::vector<Tick> ticks;
  for (int i = 0; i <= kTenths; ++i) {
    const double position = static_cast<double>(i) / kTenths;
    const int rank = i % kTenths == 0 ? 2 : i % 2 == 0 ? 1 : 0;
    ticks.push_back({position, std::lerp(scale.min, scale.max, position), rank});
  }
  return ticks;
}

int RankOf(double factor, int decade) {
  if (factor != 1) return 0;
  return decade % 4 == 0 ? kHighestRank : decade % 2 == 0 ? 2 : 1;
}

}  // namespace

std::vector<Tick> TicksOf(const render::FalseColourScale& scale, Layer layer) {
  if (IsLinear(layer)) return LinearTicks(scale);
  std::vector<Tick> ticks;
  for (int decade = static_cast<int>(std::floor(std::log10(scale.min)));
       decade <= std::ceil(std::log10(scale.max)); ++decade)
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double value = factor * std::pow(10.0, decade);
      if (value < scale.min * 0.999 || value > scale.max * 1.001) continue;
      ticks.push_back({*PositionOn(scale, layer, value), value, RankOf(factor, decade)});
    }
  if (ticks.size() < 2) return {{0, scale.min, 0}, {1, scale.max, 0}};
  return ticks;
}

std::vector<TickText> TextsOf(const std::vector<Tick>& ticks, double width, double gap,
                              const std::function<double(const std::string&)>& width_of) {
  std::vector<double> values;
  values.reserve(ticks.size());
  for (const Tick& tick : ticks) values.push_back(tick.value);
  const std::vector<std::string> labels = render::TickLabels(values);
  std::vector<TickText> texts;
  for (int rank = 0; rank <= kHighestRank; ++rank) {
    texts.clear();
    double free_from = 0;
    bool has_room = true;
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      if (ticks[i].rank < rank) continue;
      const double size = width_of(labels[i]);
      const double left =
          std::clamp(ticks[i].position * width - 0.5 * size, 0.0, std::max(0.0, width - size));
      has_room = has_room && left >= free_from;
      free_from = left + size + gap;
      texts.push_back({left, labels[i]});
    }
    if (has_room) break;
  }
  return texts;
}

}  // namespace luxfield::view
