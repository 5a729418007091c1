// What was opened to be looked at: something with a picture, or that draws itself.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "luxfield/render/feedback.h"
#include "luxfield/render/film/frame.h"
#include "luxfield/view/lighting/failure.h"
#include "luxfield/view/picture/reading.h"
#include "luxfield/view/window/window.h"

namespace luxfield::view {

// A mouse over the picture, in parts of the picture's height; keys that are held.
struct Motion {
  double right = 0, up = 0;  // of a drag
  enum class Drag { kNone, kOrbit, kPan, kTurn } drag = Drag::kNone;
  double wheel = 0;                                   // notches, away from the hand is above 0
  double fly_right = 0, fly_up = 0, fly_forward = 0;  // seconds held since the last frame
  bool fast = false;
  bool reset = false;  // back to where the file looks from
  bool Moves() const {
    return drag != Drag::kNone || wheel != 0 || fly_right != 0 || fly_up != 0 || fly_forward != 0 ||
           reset;
  }
};

// Where a picture stands in the window, in ImGui's coordinates.
struct PictureRect {
  double left = 0, top = 0, width = 0, height = 0;
};

class Document {
 public:
  virtual ~Document() = default;

  // Takes news; before each frame of the window.
  virtual void Update() {}
  // Null while there is none, or where DrawMain stands in its place.
  virtual const render::Frame* picture() const { return nullptr; }
  // Another one for each picture.
  virtual std::uint64_t picture_number() const { return 0; }
  // Of the whole picture, which one that is shown while something moves may fall below.
  virtual WindowSize picture_size() const { return {}; }
  // What guides its samples, once it is known; null of pictures that nothing is known of.
  virtual const render::Feedback* feedback() const { return nullptr; }
  // Whether it can be made, and that it is to be.
  virtual bool OffersFeedback() const { return false; }
  virtual void WantFeedback(bool /*wanted*/) {}
  // Reading::measured_rel_sigma of what lights a point of its picture.
  virtual std::optional<double> MeasuredRelSigma(const Reading&) const { return {}; }
  // Whether what DrawMain draws is what was opened, as it has no picture.
  virtual bool DrawsItself() const { return false; }
  // Draws what is no picture into the ImGui window that is begun.
  virtual void DrawMain() {}
  // Draws over its picture, likewise, and reads the mouse while it is `hovered`; whether the mouse is
  // at something there, so that it moves nothing else.
  virtual bool DrawOver(const PictureRect& /*area*/, bool /*hovered*/) { return false; }
  // Its part of the side panel, likewise.
  virtual void DrawPanel() {}
  // Moves the camera, where there is one; else the viewer moves the picture.
  virtual bool HasCamera() const { return false; }
  virtual void Move(const Motion&) {}
  // One line that says how far it is; empty: nothing is to be said.
  virtual std::string Status() const { return {}; }
  // Whether nothing more will change by itself.
  virtual bool Settled() const { return true; }
  // Seconds until something may change by itself that wakes no window.
  virtual double PollingInterval() const { return 1; }
  // Whether it has changes that would be lost with the window.
  virtual bool HasUnsaved() const { return false; }
  // Writes them; whether it could. Its panel says why not.
  virtual bool Save() { return true; }
  // Estimated relative RMSE of the picture's luminance, where it is known.
  virtual std::optional<double> Error() const { return {}; }
  // Why it cannot be shown; empty: it can.
  virtual std::optional<Failure> failure() const { return {}; }
};

}  // namespace luxfield::view
