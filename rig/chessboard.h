// The calibration pattern that the lab shows and the calibration looks for.
#pragma once

namespace luxfield::rig {

// A chessboard by its inner corners: corner (i, j) lies at (i, j) pitches, the cell between corners
// (0, 0) and (1, 1) is white (of a transparency: clear), a white frame as wide as a cell surrounds
// the outer cells. One of columns and rows is odd, the other even: a half turn swaps the colours.
struct Chessboard {
  int columns = 0, rows = 0;
  double pitch_m = 0;
};

}  // namespace luxfield::rig
