// The plots of cli/svg drawn with Cairo: the elements and attributes that they are made of, no others.
#pragma once

#include <cairo.h>

#include <string>

namespace luxfield::cli {

struct SvgSize {
  double width = 0, height = 0;
};
// Of the <svg> element.
SvgSize SizeOfSvg(const std::string& svg);

// Its upper left corner at (x, y), a unit of it `scale` units of the context long. Throws
// std::logic_error for what is not drawn: that plot has to be made of less, or this learn more.
void DrawSvg(cairo_t* context, const std::string& svg, double x, double y, double scale);

}  // namespace luxfield::cli
