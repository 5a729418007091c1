// What the window does with files that others write while it shows them, without a window.
#pragma once

#include <string>
#include <vector>

namespace luxfield::hostile {

// Shows a scene or light field, puts each new/NAME in the place of NAME, waits until the document has
// read it and renders anew, and says what it shows. Exit code 0 where a picture stands at the end;
// 2 where the scene could not be shown before anything was replaced.
int Reload(const std::string& scene, const std::vector<std::string>& names);

}  // namespace luxfield::hostile
