#include "luxfield/view/panels/shown_picture.h"

#include <utility>

namespace luxfield::view {

void ShownPicture::Update(const Document& document, const Look& look, const LayerSources& sources) {
  const Drawn now{document.picture_number(), look};
  if (std::exchange(drawn_, now) == now) return;
  const render::Frame& frame = *document.picture();
  if (look.tone == Tone::kFalseColour) scale_ = ScaleOf(frame, look, sources);
  texture_.Smooth(frame.width != document.picture_size().width);  // a preview
  texture_.Show(ColoursOf(frame, look, sources), frame.width, frame.height);
}

}  // namespace luxfield::view
