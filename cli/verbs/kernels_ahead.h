// The first picture whose estimator is chosen waits for kernels to be compiled
// (render/accuracy/pilot_kernels.h). Another process of this program, `luxfield cache --compile`, compiles
// some of them meanwhile, where that helps:
//
//   const KernelsAhead ahead(lit, options);
//   ... RenderToAccuracy ...
//
// That this was begun is kept, and nothing is started again; nor where nothing can be kept.
#pragma once

#include <sys/types.h>

#include "luxfield/cli/verbs/verb_render.h"
#include "luxfield/render/lit_scene.h"

namespace luxfield::cli {

class KernelsAhead {
 public:
  KernelsAhead(const render::LitScene& scene, const RenderVerbOptions& options);
  ~KernelsAhead();  // ends the other process
  KernelsAhead(const KernelsAhead&) = delete;
  KernelsAhead& operator=(const KernelsAhead&) = delete;

 private:
  pid_t process_ = -1;
};

}  // namespace luxfield::cli
