#include "luxfield/preprocess/sampler.h"

#include <pybind11/stl.h>

#include <limits>

#include "arrays.h"
#include "bindings.h"

namespace luxfield::python {
namespace {

namespace py = pybind11;
using preprocess::LightFieldSampler;
using preprocess::ReceiverSampler;

// Of points and normals, the first two arguments.
preprocess::Receiver ReceiverOf(const Rows& rows, std::size_t i) {
  return {rows.vec3(0, i), rows.vec3(1, i)};
}

void Put(double* out, const lightfield::Vec3& v) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }

}  // namespace

void AddSampler(py::module_& module) {
  py::class_<LightFieldSampler> type(
      module, "Sampler",
      R"(Draws directions from receivers towards a lamp, for plugins of renderers.

A receiver is a point and a normal in the luminaire's frame; a direction w points from it to the lamp.
The density follows the light that each cell of F sends to the receiver, so that the weight
L (n . w)+ / pdf is bounded (docs/theory.md, section 6). The light field is copied.)");
  type.def(py::init<lightfield::LightField>(), py::arg("field"),
           py::call_guard<py::gil_scoped_release>());
  type.def(
      "sample",
      [](const LightFieldSampler& sampler, const py::object& points, const py::object& normals,
         const py::object& xi) {
        Rows rows({{"points", points}, {"normals", normals}, {"xi", xi}}, {3, 3, 2});
        rows.Normalise(1);
        const int channels = sampler.field().geometry.channels;
        Array u = rows.Result({2}), s = rows.Result({2}), direction = rows.Result({3});
        Array distance = rows.Result({}), pdf = rows.Result({});
        Array radiance = rows.Result({channels}), weight = rows.Result({channels});
        double *u_out = u.mutable_data(), *s_out = s.mutable_data();
        double *direction_out = direction.mutable_data(), *distance_out = distance.mutable_data();
        double *pdf_out = pdf.mutable_data(), *radiance_out = radiance.mutable_data();
        double* weight_out = weight.mutable_data();
        ForEach(rows.count(), 16, [&](std::size_t i) {
          const std::optional<preprocess::LightSample> drawn =
              sampler.At(ReceiverOf(rows, i)).Sample(rows.vec2(2, i));
          const preprocess::LightSample& sample = drawn ? *drawn : preprocess::LightSample{};
          u_out[2 * i] = sample.u.x, u_out[2 * i + 1] = sample.u.y;
          s_out[2 * i] = sample.s.x, s_out[2 * i + 1] = sample.s.y;
          Put(direction_out + 3 * i, sample.direction);
          distance_out[i] = sample.distance_m;
          pdf_out[i] = drawn ? sample.pdf : 0;
          for (int c = 0; c < channels; ++c) {
            radiance_out[i * channels + c] = sample.radiance[c];
            weight_out[i * channels + c] = sample.weight[c];
          }
        });
        py::dict result;
        result["u"] = u;
        result["s"] = s;
        result["direction"] = direction;
        result["distance_m"] = distance;
        result["radiance"] = radiance;
        result["pdf"] = pdf;
        result["weight"] = weight;
        return result;
      },
      py::arg("points"), py::arg("normals"), py::arg("xi"),
      R"(One sample for each receiver, from xi[..., 2] in [0, 1).

A dict of arrays: u, s [..., 2] on F and I; direction [..., 3], unit; distance_m to u; radiance and
weight = radiance (n . w)+ / pdf [..., channel]; pdf, sr^-1, 0 where no light reaches the receiver.
The mean of weight is the irradiance.)");
  type.def(
      "pdf",
      [](const LightFieldSampler& sampler, const py::object& points, const py::object& normals,
         const py::object& directions) {
        Rows rows({{"points", points}, {"normals", normals}, {"directions", directions}},
                  {3, 3, 3});
        rows.Normalise(1);
        rows.Normalise(2);
        Array result = rows.Result({});
        double* out = result.mutable_data();
        ForEach(rows.count(), 16, [&](std::size_t i) {
          out[i] = sampler.At(ReceiverOf(rows, i)).Pdf(rows.vec3(2, i));
        });
        return result;
      },
      py::arg("points"), py::arg("normals"), py::arg("directions"),
      "The density with which `sample` draws these directions, sr^-1: [...].");
  type.def(
      "radiance",
      [](const LightFieldSampler& sampler, const py::object& points, const py::object& directions) {
        Rows rows({{"points", points}, {"directions", directions}}, {3, 3});
        rows.Normalise(1);
        const int channels = sampler.field().geometry.channels;
        Array result = rows.Result({channels});
        double* out = result.mutable_data();
        ForEach(rows.count(), 64, [&](std::size_t i) {
          const std::array<double, 3> radiance =
              sampler.At({rows.vec3(0, i), {0, 0, -1}}).Radiance(rows.vec3(1, i));
          for (int c = 0; c < channels; ++c) out[i * channels + c] = radiance[c];
        });
        return result;
      },
      py::arg("points"), py::arg("directions"),
      "Radiance that arrives at points[..., 3] from directions[..., 3]: [..., channel].");
}

}  // namespace luxfield::python
