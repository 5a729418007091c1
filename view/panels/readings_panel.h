// What is read from a picture and kept: probes, the profile between them, the histogram.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "luxfield/view/documents/document.h"
#include "luxfield/view/panels/picture_area.h"
#include "luxfield/view/picture/histogram.h"
#include "luxfield/view/picture/look.h"

namespace luxfield::view {

class ReadingsPanel {
 public:
  void Add(PicturePlace place) { probes_.push_back(place); }
  void Clear() { probes_.clear(); }
  const std::vector<PicturePlace>& probes() const { return probes_; }

  // On the picture: probes as crosses with numbers, and the line between the last two.
  void Mark(const PictureArea& area) const;
  // Into the ImGui window that is begun, of a document with a picture, of whose pixels the share
  // `saturated` is so on the screen, where that means something.
  void Draw(const Document& document, const Look& look, const std::optional<double>& saturated);

 private:
  void DrawProbes(const Document& document) const;
  void DrawProfile(const render::Frame& frame);
  void DrawHistogram(const Document& document, const Look& look,
                     const std::optional<double>& saturated);
  void DrawNumbers(const std::optional<double>& saturated) const;

  // What the histogram is of: a picture's number, and of its arriving light.
  struct Counted {
    std::uint64_t number = 0;
    bool arriving = false;
    bool operator==(const Counted&) const = default;
  };
  std::vector<PicturePlace> probes_;
  bool along_illuminance_ = false, of_illuminance_ = false;  // profile, histogram
  std::optional<Counted> counted_;
  Histogram histogram_;
};

}  // namespace luxfield::view
