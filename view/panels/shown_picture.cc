#include "luxfield/view/panels/shown_picture.h"

namespace luxfield::view {

void ShownPicture::Update(const Document& document, const Look& look,
                          const core::Image* reference) {
  if (number_ == document.picture_number() && look_ == look) return;
  const render::Frame& frame = *document.picture();
  if (look.tone == Tone::kFalseColour) scale_ = ScaleOf(frame, look, reference);
  texture_.Smooth(frame.width != document.picture_size().width);  // a preview
  texture_.Show(ColoursOf(frame, look, reference), frame.width, frame.height);
  number_ = document.picture_number();
  look_ = look;
}

}  // namespace luxfield::view
