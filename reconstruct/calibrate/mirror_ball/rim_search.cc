#include "luxfield/reconstruct/calibrate/mirror_ball/rim_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "luxfield/reconstruct/calibrate/mirror_ball/rim_edges.h"

namespace luxfield::reconstruct {
namespace {

constexpr int kSides[] = {192, 384, 768,
                          kEvidenceSide};     // longer sides of the reduced pictures, pixels
constexpr int kShortest = 24, kLongest = 56;  // radii, reduced pixels, where others are smaller
constexpr int kLeastRadius = 14;              // pixels of the picture itself
constexpr int kCentres = 6;                   // looked at for each radius
constexpr int kRefined = 20;                  // of the circles of each size
constexpr int kMoves = 3;                     // uphill, of a pixel and of half a pixel
constexpr double kApart = 2;                  // directions, reduced pixels
constexpr double kLeastSlope = 0.03;          // of ln radiance per pixel
constexpr double kAway = 0.2;                 // radians between slope and radius

constexpr double kGrowth = 0.12;  // of the radius, to outer circles
constexpr int kLeastGrowth = 4;   // reduced pixels
constexpr double kOuterStanding = 6;
constexpr double kChance = 0.03;  // share of edges along any circle

struct RatedCircle {
  Circle circle;
  double rating = 0;
};

// A picture of one size, its thinned edges, and the circles on which they lie.
class Search {
 public:
  Search(const core::Image& picture, const ProbeOptics& optics, double factor)
      : factor_(factor), optics_(optics), field_(FindEdges(picture, factor)) {
    Thin();
  }

  // The best of radii from `shortest` to `longest`, reduced pixels.
  void AddCircles(int shortest, int longest, std::vector<RatedCircle>& circles) const {
    for (int r = shortest; r <= longest; ++r) {
      core::Image votes = Votes(r);
      const auto [mean, deviation] = Spread(votes);
      for (int n = 0; n < kCentres; ++n) {
        const auto top = std::max_element(votes.data.begin(), votes.data.end());
        const auto index = static_cast<int>(top - votes.data.begin());
        const int row = index / votes.width, column = index % votes.width;
        circles.push_back({{(column + 0.5) / factor_, (row + 0.5) / factor_, r / factor_},
                           (*top - mean) / deviation});
        Clear(votes, row, column);
      }
    }
  }

  // The circle of the picture itself, moved uphill in the share of its rim that lies on edges;
  // rated by that share, a large circle's counting more as it deviates less by chance.
  RatedCircle Refined(Circle best) const {
    double share = ShareOnEdge(field_, optics_, best, kApart);
    for (const double step : {1 / factor_, 0.5 / factor_})
      for (int moves = 0; moves < kMoves; ++moves) {
        const Circle from = best;
        for (int k = 0; k < 27; ++k) {
          const Circle next{from.x + step * (k % 3 - 1), from.y + step * (k / 3 % 3 - 1),
                            from.radius + step * (k / 9 - 1)};
          if (const double s = ShareOnEdge(field_, optics_, next, kApart); s > share)
            share = s, best = next;
        }
        if (best.x == from.x && best.y == from.y && best.radius == from.radius) break;
      }
    return {best, (share - kChance) * std::sqrt(best.radius)};
  }

  RimEvidence evidence(const Circle& circle) const { return Evidence(field_, optics_, circle); }

 private:
  struct Edge {
    float x, y;    // place, pixels
    float nx, ny;  // direction of the slope
  };

  // Pixels at which the slope is steeper than next to it along itself.
  void Thin() {
    const core::Image& g = field_.slope;
    for (int row = 1; row + 1 < g.height; ++row)
      for (int column = 1; column + 1 < g.width; ++column) {
        const double x = g.at(0, row, column), y = g.at(1, row, column), size = std::hypot(x, y);
        if (size < kLeastSlope) continue;
        const double nx = x / size, ny = y / size;
        const double before = SizeAt(column + 0.5 - nx, row + 0.5 - ny),
                     after = SizeAt(column + 0.5 + nx, row + 0.5 + ny);
        if (size < before || size <= after) continue;
        const double bend = before - 2 * size + after;
        const double shift = bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
        edges_.push_back({float(column + 0.5 + shift * nx), float(row + 0.5 + shift * ny),
                          float(nx), float(ny)});
      }
  }

  double SizeAt(double x, double y) const {
    const core::Image& g = field_.slope;
    const double u = std::clamp(x - 0.5, 0.0, g.width - 1.001),
                 v = std::clamp(y - 0.5, 0.0, g.height - 1.001);
    const int column = static_cast<int>(u), row = static_cast<int>(v);
    const double a = u - column, b = v - row;
    double size = 0;
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 2; ++i)
        size += (i ? a : 1 - a) * (j ? b : 1 - b) *
                std::hypot(g.at(0, row + j, column + i), g.at(1, row + j, column + i));
    return size;
  }

  // For each place the number of edges at that distance whose slopes point at it or away from it,
  // within kAway.
  core::Image Votes(int radius) const {
    core::Image votes(field_.slope.width, field_.slope.height, 1);
    const int spread = static_cast<int>(std::ceil(kAway * radius));
    std::vector<double> cosines, sines;
    for (int k = -spread; k <= spread; ++k) {
      cosines.push_back(std::cos(double(k) / radius));
      sines.push_back(std::sin(double(k) / radius));
    }
    for (const Edge& edge : edges_)
      for (const int sense : {-radius, radius})
        for (std::size_t k = 0; k < cosines.size(); ++k) {
          const int x = static_cast<int>(edge.x +
                                         sense * (cosines[k] * edge.nx - sines[k] * edge.ny)),
                    y = static_cast<int>(edge.y +
                                         sense * (cosines[k] * edge.ny + sines[k] * edge.nx));
          if (x > 0 && y > 0 && x < votes.width && y < votes.height) votes.at(0, y, x) += 1;
        }
    return votes;
  }

  static std::pair<double, double> Spread(const core::Image& votes) {
    const auto count = static_cast<double>(votes.data.size());
    double sum = 0, squares = 0;
    for (const float v : votes.data) {
      sum += v;
      squares += double(v) * v;
    }
    const double mean = sum / count;
    return {mean, std::sqrt(std::max(squares / count - mean * mean, 0.0)) + 1};
  }

  static void Clear(core::Image& votes, int row, int column) {
    for (int y = std::max(0, row - 3); y <= std::min(votes.height - 1, row + 3); ++y)
      for (int x = std::max(0, column - 3); x <= std::min(votes.width - 1, column + 3); ++x)
        votes.at(0, y, x) = 0;
  }

  double factor_;
  ProbeOptics optics_;
  EdgeField field_;
  std::vector<Edge> edges_;
};

bool Alike(const Circle& a, const Circle& b) {
  return std::abs(a.x - b.x) + std::abs(a.y - b.y) + std::abs(a.radius - b.radius) <
         0.05 * std::max(a.radius, b.radius);
}

// Leaves the best that differ.
void KeepBest(std::vector<RatedCircle>& rated, int most) {
  std::stable_sort(rated.begin(), rated.end(),
                   [](const RatedCircle& a, const RatedCircle& b) { return a.rating > b.rating; });
  std::vector<RatedCircle> best;
  for (const RatedCircle& candidate : rated) {
    if (static_cast<int>(best.size()) == most || !(candidate.rating > 0)) break;
    if (std::none_of(best.begin(), best.end(), [&](const RatedCircle& known) {
          return Alike(known.circle, candidate.circle);
        }))
      best.push_back(candidate);
  }
  rated = std::move(best);
}

}  // namespace

std::vector<FoundCircle> SearchCircles(const core::Image& picture, const ProbeOptics& optics,
                                       int most) {
  const int longer = std::max(picture.width, picture.height),
            shorter = std::min(picture.width, picture.height);
  std::vector<RatedCircle> refined;
  std::vector<FoundCircle> found;
  for (const int side : kSides) {
    const double factor = std::min(1.0, double(side) / longer);
    const Search search(picture, optics, factor);
    // What coarser pictures have shown, again in this one.
    for (RatedCircle& candidate : refined) candidate = search.Refined(candidate.circle);
    const int longest = side == kSides[0] ? static_cast<int>(0.6 * factor * shorter) : kLongest;
    std::vector<RatedCircle> rated;
    search.AddCircles(factor == 1 ? kLeastRadius : kShortest, longest, rated);
    KeepBest(rated, kRefined);
    for (const RatedCircle& candidate : rated) refined.push_back(search.Refined(candidate.circle));
    const bool finest = factor == 1 || side == *std::rbegin(kSides);
    KeepBest(refined, finest ? most : kRefined);
    if (!finest) continue;
    for (const RatedCircle& candidate : refined)
      found.push_back({candidate.circle, search.evidence(candidate.circle)});
    break;
  }
  std::stable_sort(found.begin(), found.end(), [](const FoundCircle& a, const FoundCircle& b) {
    return a.evidence.standing > b.evidence.standing;
  });
  return found;
}

std::optional<Circle> OuterCircle(const EdgeField& edges, const ProbeOptics& optics,
                                  const Circle& circle) {
  const double pixel = 1 / edges.factor,
               most = std::max(kLeastGrowth * pixel, kGrowth * circle.radius);
  double best_share = 0;
  Circle best = circle;
  const auto look = [&](const Circle& next, double apart) {
    const double share = ShareOnEdge(edges, optics, next, apart, &circle);
    if (share > best_share) best_share = share, best = next;
  };
  for (double growth = pixel; growth <= most; growth += pixel)
    for (double y = -growth; y <= growth; y += pixel)
      for (double x = -growth; x <= growth; x += pixel)
        if (x * x + y * y <= (growth + pixel) * (growth + pixel))
          look({circle.x + x, circle.y + y, circle.radius + growth}, kApart);
  best_share = 0;
  const Circle from = best;
  for (int k = 0; k < 125; ++k)
    look({from.x + 0.5 * pixel * (k % 5 - 2), from.y + 0.5 * pixel * (k / 5 % 5 - 2),
          from.radius + 0.5 * pixel * (k / 25 - 2)},
         1);
  if (Evidence(edges, optics, best, &circle).standing < kOuterStanding) return std::nullopt;
  return best;
}

}  // namespace luxfield::reconstruct
