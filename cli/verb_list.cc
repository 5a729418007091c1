#include "luxfield/cli/verb_list.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

namespace luxfield::cli {
namespace {

constexpr std::array<VerbName, 24> kVerbs = {{
    {"devices", "List drivers, ports, a lab's devices and OpenCL devices; test a device"},
    {"simulate", "Write the true light field of a simulated lab, to judge a measurement by"},
    {"sky",
     "The sun and the sky, clear or with clouds, of a place and time as an environment map, or of "
     "a day as a sequence"},
    {"plan",
     "Expand a plan against a lab: positions, exposures, time, bytes; or find the plan that a "
     "scene needs for an error"},
    {"capture",
     "Measure a plan into a session folder; Ctrl-Z pauses a light field and goes on, Ctrl-C ends, "
     "--resume continues"},
    {"verify", "Check every byte of a session; --salvage keeps what is whole of a damaged one"},
    {"report",
     "How a session went, as a page: what is whole, drift, exposures, re-shoots, temperatures, "
     "stage, lamp supply"},
    {"calibrate", "Calibrate parts of a lab: sensor, response, geometry, flat field, glare"},
    {"filter", "Print optical filters, and measure them"},
    {"probe", "A bracketed photograph of a mirroring ball or a fisheye sky as an environment map"},
    {"merge",
     "Merge the exposure brackets of a session into irradiance, or a stack of pictures into "
     "radiance, with error bars"},
    {"reconstruct", "Solve measurements for the coefficient images of the light field"},
    {"budget",
     "Where the uncertainty of radiance, flux and irradiance comes from: noise, exposure, drift, "
     "stage, geometry, filter, stray light, missing positions, light meter, basis"},
    {"import", "Turn a ray file into light fields"},
    {"export", "Write a light field as rays, intensities, pictures or a web page"},
    {"preprocess", "Build the sampling tables of a light field"},
    {"render", "Light a scene with measured luminaires and environment maps"},
    {"relight", "Scale lights of a picture of 'render --light-groups'"},
    {"photometry",
     "Flux, intensity, beam, illuminance of a light field with their uncertainties, as a page, "
     "certificate, JSON or CSV"},
    {"shard",
     "Cut a merge or a reconstruction into shards for a cluster, and join them to the same bytes"},
    {"info", "What a file or session is, and whether it is whole"},
    {"compare", "How far picture (or light field) A is from the reference B"},
    {"cache",
     "What is kept between runs (kernels, tables, volumes): its size, its limit, or clear it"},
    {"demo", "The whole chain on a simulated headlight, with a report"},
}};

}  // namespace

std::span<const VerbName> Verbs() { return kVerbs; }

const VerbName& VerbNamed(std::string_view name) {
  const auto verb = std::find_if(kVerbs.begin(), kVerbs.end(),
                                 [&](const VerbName& one) { return one.name == name; });
  if (verb == kVerbs.end()) throw std::logic_error("no verb is called " + std::string(name));
  return *verb;
}

}  // namespace luxfield::cli
