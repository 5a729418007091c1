// The shares that a pilot chooses whose shadow rays had to be traced first (mis.clh: TWO_STEP).
#include "luxfield/render/kernels/mis/light_share.clh"
#include "luxfield/render/kernels/sample/totals.clh"

__kernel void ChooseShares(__constant const SamplingParams* sampling, TASK_ARGUMENTS,
                           SHADOW_RAY_ARGUMENTS, __global const uchar* hidden,
                           __global float* light_shares) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  const ShadowRays shadow = PixelShadowRays(SHADOW_RAYS, sampling->shadow_rays, item);
  if (shadow.pending->scale == 0.0f) return;
  __global const uchar* hidden_rays = hidden + (size_t)item * (size_t)sampling->shadow_rays;
  Pilot pilot;
  pilot.count = 0;
  for (int k = 0; k < shadow.range->end; ++k)
    if (!hidden_rays[k])
      AddToPilot(&pilot, ShownLuminance(KeptContribution(&shadow, k)), KeptTag(&shadow, k));
  const LightTask task = TaskOf(sampling, tasks, pixel);
  light_shares[pixel] =
      BestLightShare(&pilot, sampling->newton_steps, PilotGuard(sampling, &task));
}
