#include "luxfield/reconstruct/solve/flux_window.h"

#include <algorithm>

namespace luxfield::reconstruct {
namespace {

constexpr std::size_t kCells = 4096;
constexpr std::uint64_t kMostKept = 16384;

}  // namespace

void FluxQuantile::Start(double target, double low, double high, std::uint64_t count) {
  target_ = target;
  below_ = 0;
  done_ = !Enclose(low, high, count);
}

bool FluxQuantile::Enclose(double low, double high, std::uint64_t count) {
  low_ = low;
  high_ = high;
  cells_.clear();
  kept_.clear();
  if (!(low < high)) return false;
  if (count > kMostKept)
    cells_.resize(kCells);
  else
    kept_.reserve(count);
  return true;
}

void FluxQuantile::Add(double x, double flux) {
  if (done_ || x < low_ || x > high_) return;
  if (cells_.empty()) {
    kept_.emplace_back(x, flux);
    return;
  }
  const double place = (x - low_) / (high_ - low_) * static_cast<double>(kCells);
  Cell& cell = cells_[std::min(static_cast<std::size_t>(place), kCells - 1)];
  cell.low = cell.count == 0 ? x : std::min(cell.low, x);
  cell.high = cell.count == 0 ? x : std::max(cell.high, x);
  cell.flux += flux;
  ++cell.count;
}

bool FluxQuantile::EndPass() {
  if (done_) return false;
  if (cells_.empty()) {
    TakeFromKept();
    return false;
  }
  Cell enclosing;
  for (const Cell& cell : cells_) {
    if (cell.count == 0) continue;
    below_ += enclosing.flux;
    enclosing = cell;
    if (below_ + cell.flux >= target_) break;
  }
  done_ = !Enclose(enclosing.low, enclosing.high, enclosing.count);
  return !done_;
}

void FluxQuantile::TakeFromKept() {
  std::sort(kept_.begin(), kept_.end());
  for (const auto& [x, flux] : kept_) {
    low_ = x;
    below_ += flux;
    if (below_ >= target_) break;
  }
  kept_ = {};
  done_ = true;
}

void FluxWindow::Add(double x, double flux) {
  if (!(flux > 0)) return;
  if (!first_) {
    for (FluxQuantile& end : ends_) end.Add(x, flux);
    return;
  }
  window_.low = count_ == 0 ? x : std::min(window_.low, x);
  window_.high = count_ == 0 ? x : std::max(window_.high, x);
  flux_ += flux;
  ++count_;
}

bool FluxWindow::EndPass() {
  if (first_ && !(outside_ > 0)) return false;
  if (first_) {
    first_ = false;
    ends_[0].Start(outside_ * flux_, window_.low, window_.high, count_);
    ends_[1].Start((1 - outside_) * flux_, window_.low, window_.high, count_);
    return window_.low < window_.high;
  }
  const bool more_low = ends_[0].EndPass(), more_high = ends_[1].EndPass();
  if (!more_low && !more_high) window_ = {ends_[0].value(), ends_[1].value()};
  return more_low || more_high;
}

}  // namespace luxfield::reconstruct
