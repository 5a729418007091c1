#include "luxfield/lightfield/light_vector_rows.h"

#include <algorithm>

#include "luxfield/lightfield/projected_texels.h"

namespace luxfield::lightfield {

LightVectorRows::LightVectorRows(const LightField& field, std::span<const double> x_m, double z_m)
    : field_(field), points_(x_m.size()), z_m_(z_m) {
  const LuminaireGeometry& g = field.geometry;
  begin_.assign(g.grid.width, g.lattice.width);
  end_.assign(g.grid.width, 0);
  if (!(z_m > 0)) return;
  for (const double x : x_m) {
    const auto pencil = PencilAxis::ThroughPoint(x, z_m, g.delta_m);
    for (int i = 0; i < g.grid.width; ++i) {
      const ProjectedTexels seen = ProjectTexels(g.grid.basis, g.grid.u0_m, g.grid.spacing_m, i,
                                                 TexelAxis::Columns(g.lattice), pencil);
      const int count = static_cast<int>(seen.size());
      runs_.push_back({seen.first, count, zeroth_.size()});
      for (const double value : seen.zeroth) zeroth_.push_back(value / z_m);
      for (const double value : seen.moment) moment_.push_back(value / z_m / z_m);
      if (count == 0) continue;
      begin_[i] = std::min(begin_[i], seen.first);
      end_[i] = std::max(end_[i], seen.first + count);
    }
  }
}

std::vector<LightVector> LightVectorRows::At(double y_m) const {
  std::vector<LightVector> row(points_);
  if (!(z_m_ > 0)) return row;
  const LuminaireGeometry& g = field_.geometry;
  const auto seen =
      ProjectAllTexels(g.grid.basis, g.grid.v0_m, g.grid.spacing_m, g.grid.height,
                       TexelAxis::Rows(g.lattice), PencilAxis::ThroughPoint(y_m, z_m_, g.delta_m));
  std::vector<double> zeroth(g.lattice.width), moment(g.lattice.width);
  for (int channel = 0; channel < g.channels; ++channel)
    for (int i = 0; i < g.grid.width; ++i) {
      const int begin = begin_[i], count = end_[i] - begin;
      if (count <= 0) continue;
      std::fill_n(zeroth.begin(), count, 0.0);
      std::fill_n(moment.begin(), count, 0.0);
      for (int j = 0; j < g.grid.height; ++j)
        for (std::size_t r = 0; r < seen[j].size(); ++r) {
          const double y_zeroth = seen[j].zeroth[r] / z_m_,
                       y_moment = seen[j].moment[r] / z_m_ / z_m_;
          const float* c = &field_.image(g.grid.index(i, j),
                                         channel)[(seen[j].first + r) * g.lattice.width + begin];
          for (int k = 0; k < count; ++k) {
            zeroth[k] += y_zeroth * c[k];
            moment[k] += y_moment * c[k];
          }
        }
      for (std::size_t k = 0; k < points_; ++k) {
        const Run& run = runs_[k * g.grid.width + i];
        const double *x_zeroth = &zeroth_[run.offset], *x_moment = &moment_[run.offset],
                     *s_zeroth = &zeroth[run.first - begin], *s_moment = &moment[run.first - begin];
        Vec3 sum;
        for (int n = 0; n < run.count; ++n) {
          sum.x += x_moment[n] * s_zeroth[n];
          sum.y += x_zeroth[n] * s_moment[n];
          sum.z -= x_zeroth[n] * s_zeroth[n];
        }
        row[k].j[channel] = row[k].j[channel] + (g.delta_m * g.delta_m) * sum;
      }
    }
  if (g.channels == 1)
    for (LightVector& vector : row) vector.j[1] = vector.j[2] = vector.j[0];
  return row;
}

}  // namespace luxfield::lightfield
