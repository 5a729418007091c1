// Sampling of knot cells on F (docs/theory.md 6, correction 3).
//
// `cells` draws cells in proportion to the mass of their windows times the receiver's cosine, by
// systematic allocation, and points in a cell by its table Q (preprocess/cell_tables.h) or by the
// fit of the images in the middle of its window (kernels/luminaire/cell_fit.clh), combined by the
// balance heuristic; a sample evaluates all n^2 images that shine through the cell. Unbiased; every
// contribution is at most 40 q A / K, A = sum of the cells' masses times cosines and q that of the
// basis. On glossy surfaces whose lobe is narrow against the lamp a share of the samples follows
// the BRDF instead, by the same heuristic.
//
// By shadow maps a cell is seen or not, E = sum_c V_c E_c, where estimators of images take
// E = sum_m v_m E_m with v_m the mean of V_c (thesis 4.5.2).
#pragma once

#include <string>

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& CellsTraits();
// `build_options` are added to those of its kernels.
std::unique_ptr<Estimator> MakeCells(const Device& device, const std::string& build_options = {});

}  // namespace luxfield::render
