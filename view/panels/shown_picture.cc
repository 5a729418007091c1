#include "luxfield/view/panels/shown_picture.h"

#include <utility>
#include <vector>

namespace luxfield::view {

void ShownPicture::Update(const Document& document, const Look& look, const LayerSources& sources) {
  const Drawn now{document.picture_number(), look};
  if (std::exchange(drawn_, now) == now) return;
  const render::Frame& frame = *document.picture();
  if (look.tone == Tone::kFalseColour) scale_ = ScaleOf(frame, look, sources);
  texture_.Smooth(frame.width != document.picture_size().width);  // a preview
  const std::vector<std::uint8_t> colours = ColoursOf(frame, look, sources);
  saturated_ = look.tone == Tone::kFalseColour ? std::nullopt : std::optional(Saturated(colours));
  texture_.Show(colours, frame.width, frame.height);
}

}  // namespace luxfield::view
