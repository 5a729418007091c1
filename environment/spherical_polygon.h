// Polygons on the sphere of directions whose edges are great circles: solid angle and the integral
// of the direction in closed form. Vertices are vectors of any positive length; a polygon is
// counter- clockwise where a . (b x c) > 0, seen from outside the sphere.
#pragma once

#include <span>
#include <vector>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::environment {

// Signed solid angle, sr, of a triangle (van Oosterom and Strackee 1983):
//
//   tan(Omega / 2) = a . (b x c) / (|a||b||c| + (a.b)|c| + (b.c)|a| + (c.a)|b|)
//
// The triple product is taken of differences, so that a small triangle keeps its relative
// precision.
double TriangleSolidAngle(lightfield::Vec3 a, lightfield::Vec3 b, lightfield::Vec3 c);

// The same of a polygon smaller than a hemisphere, convex or not, as a fan; 0 below three vertices.
double PolygonSolidAngle(std::span<const lightfield::Vec3> polygon);

// integral of w dw over a polygon, counter-clockwise: (1/2) sum_k gamma_k (v_k x v_k+1) / |v_k x
// v_k+1|, gamma_k the angle between neighbouring vertices (Lambert 1760). n . of it is the
// projected solid angle of a polygon above the horizon of n.
lightfield::Vec3 PolygonVectorIrradiance(std::span<const lightfield::Vec3> polygon);

// The part of `polygon` with n . v >= 0, into `clipped` (Sutherland and Hodgman 1974; a concave
// polygon may come out with edges that double back, which the integrals above do not see).
void ClipByPlane(std::span<const lightfield::Vec3> polygon, lightfield::Vec3 n,
                 std::vector<lightfield::Vec3>& clipped);

// Signed solid angle of what a polygon has in common with the cap of angular radius
// `radius` < pi / 2 around `axis` (unit), which is counter-clockwise: the sum over the edges of
// what the triangle (axis, a, b) has in common with the cap, in closed form a triangle where the
// edge runs inside and a sector (1 - cos radius) times the azimuth around the axis where it runs
// outside. 0 below three vertices; polygons that tile share the cap to 1e-15 of it.
double CapOverlapSolidAngle(std::span<const lightfield::Vec3> polygon, lightfield::Vec3 axis,
                            double radius);

}  // namespace luxfield::environment
