// Descriptors 0, 1 and 2 when the program starts and when it ends.
#pragma once

namespace luxfield::cli {

// First of all in main(): whichever of the three is closed is opened onto /dev/null. Otherwise the
// next file that is opened, a session's journal perhaps, gets its number, and progress or errors
// are written into it. A closed standard output is opened for reading only, so that what is printed
// fails (below) instead of vanishing.
void OpenClosedStandardStreams();

// From here on what is printed to `stdout` and `stderr`, which may quote any file, goes through
// core::VisibleText. Escape sequences of our own are written to the descriptor
// (core::ObeyedByTerminal).
void ShowWhatTerminalsObey();

// Last of all, and wherever printing failed on the way: hands what was printed to the system.
// Throws DeviceError (exit 3) where it cannot be written: a closed standard output, a full disk.
void FlushStandardOutput();

}  // namespace luxfield::cli
