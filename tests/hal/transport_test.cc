#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <pthread.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <fstream>
#include <functional>
#include <thread>

#include "luxfield/hal/error.h"
#include "luxfield/hal/transport/descriptor_stream.h"
#include "luxfield/hal/transport/faulty_stream.h"
#include "luxfield/hal/transport/line_reader.h"
#include "luxfield/hal/transport/open_port.h"
#include "luxfield/hal/transport/scripted_stream.h"
#include "tests/fakes/grbl_machine.h"
#include "tests/fakes/pty_host.h"
#include "tests/hal/error_of.h"
#include "tests/hal/fewer_rights.h"

namespace luxfield::hal {
namespace {

using testing::HasSubstr;

Fault FaultOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const HardwareError& error) {
    EXPECT_THAT(error.what(), HasSubstr(error.device));
    return error.fault;
  }
  ADD_FAILURE() << "no error";
  return Fault::kRefused;
}

SteadyTime Soon() { return SecondsFromNow(0.05); }
SteadyTime Later() { return SecondsFromNow(20); }

// Two ends of a socket, each with a small buffer.
struct Line {
  std::unique_ptr<DescriptorStream> near, far;
  Line() {
    std::array<int, 2> ends{};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
    const int size = 4096;
    for (const int end : ends) ::setsockopt(end, SOL_SOCKET, SO_SNDBUF, &size, sizeof size);
    near = std::make_unique<DescriptorStream>(ends[0], "near");
    far = std::make_unique<DescriptorStream>(ends[1], "far");
  }
};

std::string ReadAll(ByteStream& stream, std::size_t count) {
  std::string all;
  std::array<char, 1000> bytes;
  while (all.size() < count) {
    const std::size_t got = stream.Read(bytes, Later());
    EXPECT_GT(got, 0u);
    if (got == 0) break;
    all.append(bytes.data(), got);
  }
  return all;
}

TEST(Transport, DeadlinesAreKept) {
  Line line;
  std::array<char, 8> bytes;
  const SteadyTime deadline = Soon();
  EXPECT_EQ(line.near->Read(bytes, deadline), 0u);
  EXPECT_GE(std::chrono::steady_clock::now(), deadline);
  EXPECT_EQ(line.near->Read(bytes, deadline), 0u) << "a deadline in the past";
  line.far->Write("x", Soon());
  EXPECT_EQ(line.near->Read(bytes, deadline), 1u) << "looks once nevertheless";
  EXPECT_EQ(FaultOf([&] { line.near->Write(std::string(1 << 20, 'x'), Soon()); }), Fault::kTimeout);
}

TEST(Transport, LongWritesPassInPieces) {
  Line line;
  std::string text(300000, ' ');
  for (std::size_t k = 0; k < text.size(); ++k) text[k] = static_cast<char>('a' + k % 23);
  std::thread writer([&] { line.near->Write(text, Later()); });
  EXPECT_EQ(ReadAll(*line.far, text.size()), text);
  writer.join();
}

TEST(Transport, AClosedLineIsDisconnected) {
  Line line;
  line.far.reset();
  std::array<char, 8> bytes;
  EXPECT_EQ(FaultOf([&] { line.near->Read(bytes, Soon()); }), Fault::kDisconnected);
  EXPECT_EQ(FaultOf([&] { line.near->Write("x", Soon()); }), Fault::kDisconnected);
}

// Signals arrive throughout a conversation; none of its bytes is lost and no deadline is missed.
TEST(Transport, SignalsDoNotDisturb) {
  struct sigaction quiet {};
  quiet.sa_handler = [](int) {};  // without SA_RESTART: system calls are interrupted
  struct sigaction before {};
  ::sigaction(SIGUSR1, &quiet, &before);
  Line line;
  const std::string text(200000, 'q');
  std::atomic<int> finished = 0;
  std::thread writer([&] {
    line.near->Write(text, Later());
    ++finished;
    while (finished < 3) std::this_thread::yield();
  });
  std::string got;
  std::thread reader([&] {
    got = ReadAll(*line.far, text.size());
    std::array<char, 8> bytes;
    const SteadyTime deadline = SecondsFromNow(0.2);
    EXPECT_EQ(line.far->Read(bytes, deadline), 0u);
    EXPECT_GE(std::chrono::steady_clock::now(), deadline);
    ++finished;
    while (finished < 3) std::this_thread::yield();
  });
  while (finished < 2) {
    ::pthread_kill(writer.native_handle(), SIGUSR1);
    ::pthread_kill(reader.native_handle(), SIGUSR1);
  }
  ++finished;
  writer.join();
  reader.join();
  ::sigaction(SIGUSR1, &before, nullptr);
  EXPECT_EQ(got, text);
}

TEST(Transport, TcpIsAPortToo) {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
  const std::string name = "tcp:127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  const auto near = OpenPort(name, 0, Later());
  EXPECT_EQ(near->name(), name);
  auto far = std::make_unique<DescriptorStream>(::accept(listener, nullptr, nullptr), "far");
  ::close(listener);
  near->Write("?", Later());
  EXPECT_EQ(ReadAll(*far, 1), "?");
  far->Write("<Idle>", Later());
  EXPECT_EQ(ReadAll(*near, 6), "<Idle>");
  far.reset();
  std::array<char, 8> bytes;
  EXPECT_EQ(FaultOf([&] { near->Read(bytes, Later()); }), Fault::kDisconnected);
}

TEST(Transport, LinesAreCutAtLineFeeds) {
  LineBuffer buffer(8);
  buffer.Push("ok\r\n<Idle>");
  EXPECT_EQ(buffer.Pop(), "ok");
  EXPECT_EQ(buffer.Pop(), std::nullopt);
  buffer.Push("\n\r\nmuch too long\n12345678\nshort\r");
  EXPECT_EQ(buffer.Pop(), "<Idle>");
  EXPECT_EQ(buffer.Pop(), "");
  EXPECT_EQ(buffer.Pop(), "12345678");
  EXPECT_EQ(buffer.Pop(), std::nullopt);
  buffer.Push("\n");
  EXPECT_EQ(buffer.Pop(), "short");
}

TEST(Transport, APseudoTerminalIsASerialPort) {
  fakes::PtyHost host(std::make_unique<fakes::GrblMachine>());
  {
    const auto port = OpenPort(host.port(), 115200, Later());
    EXPECT_EQ(port->name(), host.port());
    LineReader lines(*port);
    std::optional<std::string> line;
    while ((line = lines.Next(Later())) && *line != "Grbl 1.1h ['$' for help]") {
    }
    EXPECT_TRUE(line);
    EXPECT_EQ(FaultOf([&] { OpenPort(host.port(), 115200, Later()); }), Fault::kRefused)
        << "it is in use";
    EXPECT_EQ(FaultOf([&] { OpenSerialPort(host.port(), 12345); }), Fault::kRefused);
  }
  OpenPort(host.port(), 9600, Later());
}

TEST(Transport, PortsThatCannotBeOpened) {
  EXPECT_EQ(FaultOf([] { OpenPort("/dev/nothing-here", 9600, Later()); }), Fault::kDisconnected);
  EXPECT_EQ(FaultOf([] { OpenPort("/dev/null", 9600, Later()); }), Fault::kRefused);
  EXPECT_EQ(FaultOf([] { OpenPort("tcp:localhost", 9600, Later()); }), Fault::kRefused);
  // Port 1 of this machine: nobody listens there.
  EXPECT_EQ(FaultOf([] { OpenPort("tcp:127.0.0.1:1", 9600, Later()); }), Fault::kDisconnected);
}

TEST(Transport, APortOfOthersIsRefusedWithTheGroupToJoin) {
  fakes::PtyHost host(std::make_unique<fakes::GrblMachine>());
  EXPECT_EQ(PortRefusal(host.port()), "");
  const Forbidden port(host.port());
  const HardwareError error = ErrorOf([&] { OpenSerialPort(host.port(), 9600); });
  EXPECT_EQ(error.fault, Fault::kRefused);
  EXPECT_THAT(error.what(),
              testing::AllOf(HasSubstr("Permission denied (refused); join the group dialout"),
                             HasSubstr("docs/how-to/permissions.md")));
  EXPECT_EQ(PortRefusal(host.port()), error.what());
}

TEST(Transport, ScriptsAreFollowedToTheByte) {
  ScriptedStream script({{"", "welcome\n"}, {"$$\n", "$0=1\nok\n"}, {"?", ""}});
  LineReader lines(script);
  EXPECT_EQ(lines.Next(Soon()), "welcome");
  EXPECT_EQ(lines.Next(Soon()), std::nullopt);
  script.Write("$", Soon());
  script.Write("$\n?", Soon());
  EXPECT_EQ(lines.Next(Soon()), "$0=1");
  EXPECT_EQ(lines.Next(Soon()), "ok");
  EXPECT_TRUE(script.finished());
  EXPECT_EQ(FaultOf([&] { script.Write("!", Soon()); }), Fault::kProtocol);
  ScriptedStream other(std::deque<Exchange>{{"abc", ""}});
  EXPECT_EQ(FaultOf([&] { other.Write("abd", Soon()); }), Fault::kProtocol);
}

// What a faulty line does to 100000 bytes, against the probabilities asked for.
std::string Damaged(const LineFaults& faults, std::uint64_t seed, const std::string& text) {
  auto script = std::make_unique<ScriptedStream>(std::deque<Exchange>{{"", text}});
  FaultyStream faulty(std::move(script), faults, {}, seed);
  std::string got;
  std::array<char, 64> bytes;
  while (const std::size_t count = faulty.Read(bytes, std::chrono::steady_clock::now()))
    got.append(bytes.data(), count);
  return got;
}

TEST(Transport, FaultsComeAsOftenAsAsked) {
  const std::string text(100000, 'a');
  constexpr double kRate = 0.1;
  const auto size = static_cast<double>(text.size());
  const double sigma = std::sqrt(kRate * (1 - kRate) * size);
  const auto expect = [&](double count) { EXPECT_NEAR(count, kRate * size, 5 * sigma); };
  EXPECT_EQ(Damaged({}, 1, text), text);
  LineFaults drop, duplicate, garble, truncate, hang;
  drop.drop = duplicate.duplicate = garble.garble = kRate;
  expect(static_cast<double>(text.size() - Damaged(drop, 2, text).size()));
  expect(static_cast<double>(Damaged(duplicate, 3, text).size() - text.size()));
  const std::string garbled = Damaged(garble, 4, text);
  expect(static_cast<double>(text.size()) -
         static_cast<double>(std::count(garbled.begin(), garbled.end(), 'a')));
  EXPECT_EQ(garbled, Damaged(garble, 4, text)) << "the same seed";
  EXPECT_NE(garbled, Damaged(garble, 5, text));
  truncate.truncate = 1;  // half of every piece on average
  EXPECT_NEAR(static_cast<double>(Damaged(truncate, 6, text).size()), 0.5 * size,
              5 * 64 / std::sqrt(12.0) * std::sqrt(size / 64));
  hang.hang = 1;
  EXPECT_EQ(Damaged(hang, 7, text), "");
}

TEST(Transport, DelaysNeverPassTheDeadline) {
  LineFaults slow;
  slow.delay = 1;
  slow.longest_delay_s = 1000;
  FaultyStream faulty(std::make_unique<ScriptedStream>(std::deque<Exchange>{{"", "abc"}}), slow, {},
                      1);
  std::array<char, 8> bytes;
  EXPECT_EQ(faulty.Read(bytes, Soon()), 3u);
}

}  // namespace
}  // namespace luxfield::hal
