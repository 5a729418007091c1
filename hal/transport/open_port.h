// Opening what a lab.toml calls a port.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "luxfield/hal/transport/byte_stream.h"

namespace luxfield::hal {

// A serial port or pty through termios: raw, 8 data bits, no parity, 1 stop bit, no flow control.
// The port is locked against other programs,
// and closing it does not drop the modem lines. HardwareError(kDisconnected) if it is not there,
// kRefused if it cannot be opened, is no terminal, or does not know the baud rate.
std::unique_ptr<ByteStream> OpenSerialPort(const std::string& path, int baud);

// HardwareError(kDisconnected) if nothing answers at the address, kTimeout.
std::unique_ptr<ByteStream> OpenTcp(const std::string& host, const std::string& service,
                                    SteadyTime deadline);

// Why this user may not open the port, as OpenSerialPort would say it; empty: he may. Nothing is
// opened.
std::string PortRefusal(const std::string& path);

// "tcp:HOST:PORT", or the path of a serial port. `baud` concerns serial ports only.
std::unique_ptr<ByteStream> OpenPort(const std::string& port, int baud, SteadyTime deadline);

// Serial ports that are attached, by their stable names where the system gives such
// (/dev/serial/by-id), sorted. Nothing is opened: opening restarts some controllers.
std::vector<std::string> AttachedSerialPorts();

}  // namespace luxfield::hal
