// Keys and what the mouse does, on F1.
#pragma once

namespace luxfield::view {

// A window over the others; `open` becomes false when it is closed.
void DrawHelp(bool& open);

}  // namespace luxfield::view
