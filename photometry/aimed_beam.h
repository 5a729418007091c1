// What the requirements of a regulation measure in the beam of an aimed headlamp.
#pragma once

#include <optional>
#include <vector>

#include "luxfield/photometry/beam.h"
#include "luxfield/photometry/regulation.h"

namespace luxfield::photometry {

struct Measured {
  double value = 0;  // cd; lm of a flux
  Place place;       // of a line or zone where it is smallest or largest; else its first place
};

class AimedBeam {
 public:
  // All must outlive this. A map of the beam is made, for searches: on a screen across `mounted`, the
  // frame before aiming, since planes along a light field's axes are lit many times faster.
  AimedBeam(const Lamp& lamp, const Regulation& regulation, const BeamFrame& mounted,
            const BeamFrame& frame);

  // The smallest value of a line or a zone, or the largest: the best place of a lattice, 0.05 degrees
  // along lines and 0.1 in zones (coarser in zones of more than 200 square degrees), climbed from.
  // The value is exact.
  Measured Measure(const Requirement& requirement, bool smallest) const;
  // The same without the climb, by the map, for a lamp whose aim is turned by so much.
  double Sketch(const Requirement& requirement, bool smallest, Place turned) const;

  // Of what Measure found, its place held fast: weights, and the value of a lamp that is turned.
  Functional Weights(const Requirement& requirement, Place place) const;
  double ValueOfTurned(const Requirement& requirement, Place place, Place turned) const;

  // Was all of the light towards the requirement's places within the measured part of I? Of one
  // place alone the second.
  bool IsCovered(const Requirement& requirement) const;
  bool IsCoveredAt(Place place) const;

 private:
  double Value(const BeamFrame& frame, Place place) const;
  std::vector<Place> Samples(const Requirement& requirement) const;
  double Flux(const BeamFrame& frame, const Requirement& requirement) const;
  Measured Climb(const Requirement& requirement, Measured from, bool smallest) const;

  const Lamp& lamp_;
  const BeamFrame& frame_;
  Receiver receiver_;
  BeamMap map_;
};

// Is the place in the polygon or on its border, to 1e-9 degrees?
bool Holds(const std::vector<Place>& polygon, Place place);

}  // namespace luxfield::photometry
