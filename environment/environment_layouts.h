// How the sphere of directions lies on a picture: one rule of orientation for each layout
// (docs/theory.md 8, "Probe formats"; drawn in docs/formats/environment.md).
//
// Picture points are p in [0, 1]^2, p.x to the right, p.y downwards. World frame: right-handed, z
// up. A viewer faces `forward` = -y with `right` = -x and `up` = +z, which is OpenEXR's +z with +y
// up, its frame (X, Y, Z) laid into the world as (X, -Z, Y), the way glTF's is. With
//
//   a = 2 p.x - 1,   b = 1 - 2 p.y,   r^2 = a^2 + b^2
//
// directions w and the solid angle dw of an area dA of p are:
//
// Latitude-longitude: forward in the middle, +x a quarter from the left edge.
//
//   theta = pi p.y from the zenith,   phi = pi (1 - 2 p.x)
//   w = (sin theta sin phi, -sin theta cos phi, cos theta)
//   dw/dA = 2 pi^2 sin theta
//
// Angular map: what the viewer sees, straight behind him on the rim. The angle to forward is pi r.
//
//   w = cos(pi r) forward + sin(pi r) (a right + b up) / r
//   dw/dA = 4 pi sin(pi r) / r
//
// Mirror ball: a mirroring ball photographed from far away by the viewer: mirrored, himself in the
// middle, straight ahead on the rim. The angle to -forward is 2 asin r.
//
//   w = (2 r^2 - 1) forward + 2 sqrt(1 - r^2) (a right + b up)
//   dw/dA = 16
//
// Fisheye hemisphere: the sky, equidistant, as the viewer sees it with his head laid back: +z in
// the middle, +y on top, +x at the left (north up and east at the left with x to the east), nothing
// below the horizon. The angle to +z is pi r / 2.
//
//   dw/dA = 2 pi sin(pi r / 2) / r
//
// Cube: a strip of six faces one below the other, OpenEXR's order and orientation, in the world +x,
// -x, +z, -z, -y, +y, each as environment/cube_map.h has it.
//
//   dw/dA = 24 (1 + x^2 + y^2)^(-3/2)
//
// Angular map, mirror ball and fisheye fill the disc r <= 1 and nothing outside
// of it. (Debevec, "Rendering synthetic objects into real scenes", SIGGRAPH 1998, and his light
// probes for the first two discs; OpenEXR, ImfEnvmap.h.)
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::environment {

enum class EnvironmentLayout {
  kLatitudeLongitude,
  kAngularMap,
  kMirrorBall,
  kFisheyeHemisphere,
  kCube
};

// "latitude-longitude", "angular-map", "mirror-ball", "fisheye-hemisphere", "cube".
std::string_view EnvironmentLayoutName(EnvironmentLayout layout);
std::optional<EnvironmentLayout> EnvironmentLayoutFromName(std::string_view name);
// All names, comma-separated.
std::string EnvironmentLayoutNames();

struct PictureToDirection {
  lightfield::Vec3 direction;       // unit
  double solid_angle_per_area = 0;  // dw/dA, sr
};
// Absent where the picture shows nothing.
std::optional<PictureToDirection> DirectionFromPicture(EnvironmentLayout layout,
                                                       lightfield::Vec2 p);

struct DirectionToPicture {
  lightfield::Vec2 point;
  double area_per_solid_angle = 0;  // dA/dw, 1/sr; infinite where many points show one direction
};
// Absent where no point shows the direction. Any positive length.
std::optional<DirectionToPicture> PictureFromDirection(EnvironmentLayout layout,
                                                       lightfield::Vec3 direction);

// What a pixel stands for. kCells: the picture is divided into equal rectangles. kNodes: pixel
// centres lie on a lattice that includes the borders (of each face of a cube), so that border
// pixels are cut in half: what OpenEXR defines for files with its `envmap` attribute.
enum class TexelRegistration { kCells, kNodes };

// The borders between the texels of a picture of width x height, in picture coordinates: width + 1
// and height + 1 rising numbers from 0 to 1. A cube's height is a multiple of 6.
struct TexelEdges {
  std::vector<double> x, y;
};
TexelEdges MakeTexelEdges(EnvironmentLayout layout, TexelRegistration registration, int width,
                          int height);

// Exact solid angle, sr, of what the rectangle [x0, x1] x [y0, y1] of the picture shows (within one
// face of a cube): closed forms for latitude-longitude and cube, on the discs the integral of
// 1 - cos theta over the azimuth along the border of rectangle and disc, to 1e-14.
double PictureRectangleSolidAngle(EnvironmentLayout layout, double x0, double x1, double y0,
                                  double y1);

// The curve around the part of a rectangle that shows something, as unit directions, closed, in one
// sense of rotation for all rectangles of a layout (mirrored layouts have the other). Between
// vertices it is replaced by great circles; a piece of an edge is halved until what lies between it
// and its great circle is below `tolerance` times the rectangle's solid angle. Rectangles that
// share an edge share its vertices, so that outlines tile. Empty if the rectangle shows nothing.
void PictureRectangleOutline(EnvironmentLayout layout, double x0, double x1, double y0, double y1,
                             double tolerance, std::vector<lightfield::Vec3>& outline);

}  // namespace luxfield::environment
