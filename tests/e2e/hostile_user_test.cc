// Mistakes of users, odd descriptors and sessions that somebody else made consistent: what the
// program says, and that nothing is lost.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/session/journal.h"
#include "luxfield/session/session_check.h"
#include "luxfield/session/session_store.h"
#include "luxfield/session/session_writer.h"
#include "tests/e2e/tiny_session.h"
#include "tests/e2e/verb_test.h"

namespace luxfield::e2e {
namespace {

using core::Json;
using testing::HasSubstr;
using testing::Not;

class HostileUser : public VerbTest {
 protected:
  const std::string lab_ = SourceFile("data/labs/small.toml"),
                    plan_ = SourceFile("data/plans/small.toml");

  // The program under a shell that closes or redirects descriptors: `redirections` as in sh.
  Outcome Redirected(const std::string& arguments, const std::string& redirections) {
    return RunProgram(
        {"/bin/sh", "-c", BuiltProgram("luxfield").string() + " " + arguments + " " + redirections},
        folder_);
  }
};

TEST_F(HostileUser, ClosedStreamsDoNotGetIntoTheJournal) {
  const std::string capture = "capture " + plan_ + " s --lab " + lab_;
  // What was printed is lost, which is an error; the session is whole.
  EXPECT_EQ(Redirected(capture, "<&- >&- 2>&-").exit_code, 3);
  const auto verified = RunLuxfield({"verify", "s", "--json", "v.json"}, folder_);
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  EXPECT_EQ(core::ReadJson(folder_ / "v.json").value("sealed", false), true);
}

TEST_F(HostileUser, OutputThatCannotBeWrittenIsAnError) {
  for (const char* arguments : {"--help", "--version", "render --help"}) {
    const auto full = Redirected(arguments, "> /dev/full");
    EXPECT_EQ(full.exit_code, 3) << arguments;
    EXPECT_THAT(full.err, HasSubstr("standard output")) << arguments;
  }
  EXPECT_EQ(Redirected("--version", ">&-").exit_code, 3);
  EXPECT_EQ(Redirected("info nowhere", "2> /dev/full").exit_code, 2);
  EXPECT_EQ(Redirected("--version", "").exit_code, 0);
}

// More than the stream's buffer holds fails while it is printed, not at the end.
TEST_F(HostileUser, LongOutputThatCannotBeWrittenIsTheSameError) {
  lightfield::LightField field;
  field.geometry.delta_m = 0.3;
  field.geometry.grid.width = field.geometry.grid.height = 1;
  field.geometry.grid.spacing_m = 0.01;
  field.geometry.lattice = {1, 1, 0, 0, 0.01, 0.01};
  field.data = {1};
  field.provenance["notes"] = std::string(100000, 'x');
  lightfield::WriteLightField(folder_ / "x.lf.exr", field);
  for (const char* where : {">&-", "> /dev/full"}) {
    const auto outcome = Redirected("info x.lf.exr", where);
    EXPECT_EQ(outcome.exit_code, 3) << where;
    EXPECT_THAT(outcome.err, HasSubstr("standard output")) << where;
  }
}

TEST_F(HostileUser, MisspeltWordsAreNamed) {
  struct Mistake {
    std::vector<std::string> typed;
    std::string said;
  };
  for (const Mistake& mistake : std::vector<Mistake>{
           {{}, "a verb is missing"},
           {{"rendr", "scene.toml"}, "there is no verb 'rendr'; did you mean 'render'?"},
           {{"slice", "plan", "x"}, "there is no verb 'slice';"},
           {{"calibrate", "sensro", "s"}, "did you mean 'sensor'?"},
           {{"render", "s.toml", "-o", "x.exr", "--sppp", "3"}, "--sppp; did you mean '--spp'?"},
           {{"render", "s.toml", "-o", "x.exr", "--wavelength", "3"}, "does not know --wavelength"},
           {{"merge", "-o", "x.meas.exr", "--", plan_}, plan_ + ": is a plan, not"},
           {{"info", "--", "--help"}, "luxfield: --help: "},
       }) {
    const auto outcome = RunLuxfield(mistake.typed, folder_);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr(mistake.said));
  }
}

TEST_F(HostileUser, MisspeltKeysAreNamed) {
  std::string plan = ReadText(plan_);
  const auto at = plan.find("delta_m");
  WriteText(folder_ / "p.toml", plan.replace(at, 7, "delta_mm"));
  const auto outcome = RunLuxfield({"plan", "p.toml", "--lab", lab_}, folder_);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("rig.delta_m is missing"));
  EXPECT_THAT(outcome.err, HasSubstr("was 'delta_mm' to be it?"));
}

TEST_F(HostileUser, ACaptureThatDoesNotExistIsNotResumed) {
  const auto outcome = RunLuxfield({"capture", plan_, "s", "--lab", lab_, "--resume"}, folder_);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("s: does not exist, so there is nothing to resume"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "s"));
}

TEST_F(HostileUser, AFileSizeLimitIsAnErrorThatNamesTheFile) {
  const auto outcome = RunProgram({"/bin/sh", "-c",
                                   "ulimit -f 4; exec " + BuiltProgram("luxfield").string() +
                                       " sky -o sky.exr --latitude 48 --date 2024-06-21"},
                                  folder_);
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("sky"));
}

// Where the compiler of kernels cannot write what it made it calls exit(1).
TEST_F(HostileUser, ALibraryThatEndsTheProgramIsAnErrorOfTheDevice) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.1;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBox), 1, 1, 0.1);
  geometry.lattice = {4, 4, -0.1, 0.1, 0.05, 0.05};
  lightfield::LightField field(geometry);
  std::ranges::fill(field.data, 1.0f);
  lightfield::WriteLightField(folder_ / "x.lf.exr", field);
  WriteText(folder_ / "s.toml",
            "[camera]\nposition = [0, -3, 1]\nlook_at = [0, 0, 0]\n[[material]]\nname = "
            "\"m\"\nalbedo = [0.5, 0.5, 0.5]\n"
            "[[quad]]\ncorner = [-1, -1, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 2, 0]\n"
            "material = \"m\"\n[[luminaire]]\nfile = \"x.lf.exr\"\nposition = [0, 0, 1]\n"
            "look_at = [0, 0, 0]\nup = [0, 1, 0]\n");
  for (const auto& [limit, said] :
       {std::pair{"-f 97", "luxfield: a library ended the program after its message"},
        std::pair{"-n 12", "file descriptors and only "}}) {  // without which PoCL aborts
    const auto outcome = RunProgram(
        {"/bin/sh", "-c",
         std::string("ulimit ") + limit +
             "; export XDG_CACHE_HOME=\"$PWD/c\" POCL_CACHE_DIR=\"$PWD/c\"; exec " +
             BuiltProgram("luxfield").string() +
             " render s.toml -o o.exr --estimator windowed --spp 2 --width 16 --height 12"},
        folder_);
    EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(said));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "o.exr"));
  }
}

TEST_F(HostileUser, VerifyRecommendsSalvageForDamageOnly) {
  ASSERT_EQ(RunLuxfield({"capture", plan_, "s", "--lab", lab_, "--quiet"}, folder_).exit_code, 0);
  WriteText(folder_ / "s/.DS_Store", "made by a file manager");
  const auto stray = RunLuxfield({"verify", "s"}, folder_);
  EXPECT_EQ(stray.exit_code, 2);
  EXPECT_THAT(stray.out, HasSubstr(".DS_Store: is not in the manifest"));
  EXPECT_THAT(stray.err, Not(HasSubstr("--salvage")));
  EXPECT_EQ(RunLuxfield({"verify", "s", "--salvage"}, folder_).exit_code, 2);
  std::filesystem::remove(folder_ / "s/.DS_Store");
  const auto whole = RunLuxfield({"verify", "s", "--salvage"}, folder_);
  EXPECT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_THAT(whole.out, HasSubstr("s: nothing to salvage"));
  EXPECT_THAT(whole.out, HasSubstr("s: sealed, "));

  std::filesystem::copy(folder_ / "s", folder_ / "linked",
                        std::filesystem::copy_options::recursive);
  std::filesystem::rename(folder_ / "linked/darks", folder_ / "elsewhere");
  std::filesystem::create_symlink(folder_ / "elsewhere", folder_ / "linked/darks");
  const auto linked = RunLuxfield({"verify", "linked"}, folder_);
  EXPECT_EQ(linked.exit_code, 2);
  EXPECT_THAT(linked.err, Not(HasSubstr("--salvage")));
  EXPECT_THAT(linked.err, HasSubstr("where it was captured"));

  // As a capture leaves it that was interrupted before it sealed.
  std::filesystem::copy(folder_ / "s", folder_ / "paused",
                        std::filesystem::copy_options::recursive);
  std::filesystem::remove(folder_ / "paused/manifest.json");
  std::string journal = ReadText(folder_ / "paused/journal.jsonl");
  journal.resize(journal.rfind('\n', journal.size() - 2) + 1);  // without its line "sealed"
  WriteText(folder_ / "paused/journal.jsonl", journal);
  EXPECT_THAT(RunLuxfield({"verify", "paused"}, folder_).err, Not(HasSubstr("--salvage")));

  std::string first = session::SessionReader(folder_ / "s").frames().front().file;
  std::string frame = ReadText(folder_ / "s" / first);
  frame.back() ^= 1;
  WriteText(folder_ / "s" / first, frame);
  const auto damaged = RunLuxfield({"verify", "s"}, folder_);
  EXPECT_EQ(damaged.exit_code, 2);
  EXPECT_THAT(damaged.err, HasSubstr("--salvage"));
}

TEST_F(HostileUser, PathsThatTheSystemRefusesAreNoBugs) {
  const auto longest = RunLuxfield({"verify", std::string(300, 'x')}, folder_);
  EXPECT_EQ(longest.exit_code, 2) << longest.err;
  EXPECT_THAT(longest.err, HasSubstr("cannot be used"));
  std::filesystem::create_symlink("loop", folder_ / "loop");
  EXPECT_EQ(RunLuxfield({"verify", "loop"}, folder_).exit_code, 2);
}

// What files say reaches no terminal as it is: here a plan's name and a light field's provenance.
TEST_F(HostileUser, TextOfFilesIsMadeVisible) {
  const std::string hostile = "\x1b[31mred\x1b]0;title\x07";
  lightfield::LightField field;
  field.geometry.delta_m = 0.3;
  field.geometry.grid.width = field.geometry.grid.height = 1;
  field.geometry.grid.spacing_m = 0.01;
  field.geometry.lattice = {1, 1, 0, 0, 0.01, 0.01};
  field.data = {1};
  field.provenance["notes"] = hostile +
                              "\xc2\x9b"
                              "1m, gr\xc3\xbcn";
  lightfield::WriteLightField(folder_ / "x.lf.exr", field);
  const auto info = RunLuxfield({"info", "x.lf.exr"}, folder_);
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_THAT(info.out, HasSubstr("gr\xc3\xbcn"));
  WriteText(folder_ / "p.toml", "[plan]\nname = 'a'\n[" + hostile + "]\n");
  const auto refused = RunLuxfield({"plan", "p.toml", "--lab", lab_}, folder_);
  EXPECT_EQ(refused.exit_code, 2);

  core::Json plan;
  ASSERT_EQ(RunLuxfield({"capture", plan_, "s", "--lab", lab_, "--quiet"}, folder_).exit_code, 0);
  std::string text = ReadText(folder_ / "s/plan.json");
  const std::string name = "\"small\"";
  ASSERT_NE(text.find(name), std::string::npos);
  WriteText(folder_ / "s/plan.json",
            text.replace(text.find(name), name.size(), "\"\\u001b[31mred\\u0007\\u202e\""));
  const auto report = RunLuxfield({"report", "s", "-o", "r.html"}, folder_);
  const std::string html =
      std::filesystem::exists(folder_ / "r.html") ? ReadText(folder_ / "r.html") : "";
  for (const std::string& shown : {info.out, info.err, refused.err, report.out, report.err, html})
    for (const char* obeyed : {"\x1b", "\x07", "\xc2\x9b", "\xe2\x80\xae"})
      EXPECT_THAT(shown, Not(HasSubstr(obeyed)));
}

TEST_F(HostileUser, AnErrorIsOneLine) {
  const auto outcome = RunLuxfield({"info", "no\nluxfield: done"}, folder_);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

// A plan that a command writes is read; a pipe without a writer, and devices, are refused.
TEST_F(HostileUser, PipesAndDevicesAsInputs) {
  const auto piped = RunProgram({"/bin/sh", "-c",
                                 "mkfifo p; cat " + plan_ + " > p & exec " +
                                     BuiltProgram("luxfield").string() + " plan p --lab " + lab_},
                                folder_);
  EXPECT_EQ(piped.exit_code, 0) << piped.err;
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"plan", "/dev/zero", "--lab", lab_}, {"reconstruct", "/dev/zero", "-o", "x.lf.exr"}}) {
    const auto device = RunLuxfield(words, folder_);
    EXPECT_EQ(device.exit_code, 2) << words[1];
    EXPECT_THAT(device.err, HasSubstr("is a device, not a file")) << words[1];
  }
}

// A polygon's triangulation takes time by the square of its corners: seconds in assimp.
TEST_F(HostileUser, ATerminationEndsAForeignParserAtOnce) {
  std::string mesh, polygon = "f";
  for (int i = 0; i < 10000; ++i) {
    const double angle = 2 * 3.14159265358979 * i / 10000, radius = 1 + 0.5 * (i % 2);
    mesh += fmt::format("v {:.5f} {:.5f} 0\n", radius * std::cos(angle), radius * std::sin(angle));
    polygon += fmt::format(" {}", i + 1);
  }
  for (int face = 0; face < 30; ++face) mesh += polygon + "\n";
  WriteText(folder_ / "m.obj", mesh);
  WriteText(folder_ / "s.toml",
            "[camera]\nposition = [0, -3, 1]\nlook_at = [0, 0, 0]\n[[mesh]]\nfile = 'm.obj'\n");
  const auto ended =
      RunProgram({"/bin/sh", "-c",
                  BuiltProgram("luxfield").string() +
                      " info s.toml & p=$!; c=; while kill -0 $p && [ -z \"$c\" ]; do sleep 0.02; "
                      "read c rest < /proc/$p/task/$p/children; done; kill -TERM $p; wait $p; "
                      "code=$?; ! kill -0 $c && exit $code"},
                 folder_);
  EXPECT_EQ(ended.exit_code, 4) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("interrupted"));
}

// A picture's file of a library's own words is one sentence of ours.
TEST_F(HostileUser, LibrariesSayNothingOfTheirOwn) {
  WriteText(folder_ / "a.png", std::string("\x89PNG\r\n\x1a\n") + std::string(200, 'x'));
  WriteText(folder_ / "b.jpg", std::string("\xff\xd8\xff\xe0") + std::string(200, 'x'));
  for (const char* file : {"a.png", "b.jpg"}) {
    const auto outcome =
        RunLuxfield({"merge", file, file, "--exposure", "1", "2", "-o", "o.exr"}, folder_);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, testing::StartsWith("luxfield: "));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

// Every bit of a manifest counts, of its keys and white space too.
TEST_F(HostileUser, EveryFlippedBitOfAManifestIsFound) {
  WriteText(folder_ / "lab.toml", TinyLab(10, 0));
  WriteText(folder_ / "plan.toml", TinyPlan(1, 1));
  ASSERT_EQ(
      RunLuxfield({"capture", "plan.toml", "s", "--lab", "lab.toml", "--quiet"}, folder_).exit_code,
      0);
  const auto path = folder_ / "s/manifest.json";
  const std::string whole = ReadText(path);
  ASSERT_TRUE(session::VerifySession(folder_ / "s").problems.empty());
  int flips = 0, missed = 0;
  for (std::size_t at = 0; at < whole.size(); at += 3)  // each third byte, a bit of it
    for (int bit = static_cast<int>(at / 3 % 8); bit < 8; bit += 8, ++flips) {
      std::string flipped = whole;
      flipped[at] = static_cast<char>(flipped[at] ^ (1 << bit));
      WriteText(path, flipped);
      const bool found = !session::VerifySession(folder_ / "s").problems.empty();
      missed += !found;
      EXPECT_TRUE(found) << "byte " << at << ", bit " << bit << ": "
                         << whole.substr(at > 20 ? at - 20 : 0, 40);
    }
  WriteText(path, whole + "\n");
  EXPECT_FALSE(session::VerifySession(folder_ / "s").problems.empty());
  std::printf("%d bits flipped, %d missed\n", flips, missed);
}

// A session of one filter position and of targets, written with hashes that fit.
class ConsistentSession : public HostileUser {
 protected:
  void Write(const Json& plan, const Json& camera, const std::vector<session::FrameRecord>& records,
             int reference_width) {
    core::SimulatedClock clock;
    auto writer =
        session::SessionWriter::Create(folder_ / "s", plan, {{"camera", camera}}, {}, clock);
    writer.StartEpoch({{"camera", "test"}});
    for (const auto& record : records) {
      session::RawFrame frame;
      frame.width = record.kind == session::FrameKind::kReference ? reference_width : 5;
      frame.height = 3;
      frame.dn.assign(frame.size(), 100);
      writer.CommitFrame(record, frame, {});
    }
    writer.Seal("done");
  }
  static session::FrameRecord Record(session::FrameKind kind, int i = -1) {
    session::FrameRecord record;
    record.kind = kind;
    record.i = i;
    record.exposure_s = record.requested_exposure_s = 0.1;
    return record;
  }
};

TEST_F(ConsistentSession, InfoCountsFramesOfTargets) {
  Write({{"kind", "geometry"}}, {{"width", 5}, {"height", 3}},
        {Record(session::FrameKind::kTarget, 0), Record(session::FrameKind::kTarget, 1)}, 5);
  const auto outcome = RunLuxfield({"info", "s"}, folder_);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("2 of targets"));
}

TEST_F(ConsistentSession, PlansOfAWrongTypeAreNoBugs) {
  Write({{"kind", 7}}, {{"width", 5}, {"height", 3}}, {Record(session::FrameKind::kDark)}, 5);
  for (const std::vector<std::string>& verb :
       std::vector<std::vector<std::string>>{{"calibrate", "glare", "s", "-o", "g.cal.json"},
                                             {"calibrate", "geometry", "s", "-o", "g.cal.json"},
                                             {"filter", "measure", "s", "-o", "f.filter.exr"}}) {
    const auto outcome = RunLuxfield(verb, folder_);
    EXPECT_EQ(outcome.exit_code, 2) << verb[1];
    EXPECT_THAT(outcome.err, HasSubstr("field 'kind' = 7 has the wrong type")) << verb[1];
  }
}

// A journal whose session.json is another one, its chain of hashes made anew; no manifest.
void Reseal(const std::filesystem::path& session, const std::string& sha256) {
  const auto path = session / "journal.jsonl";
  std::string journal, prev(64, '0');
  std::uint64_t seq = 0;
  for (Json record : session::ReadJournal(path).records) {
    const auto type = record["type"].get<std::string>();
    if (record.contains("session_sha256")) record["session_sha256"] = sha256;
    for (const char* key : {"seq", "prev", "type", "crc32c"}) record.erase(key);
    const std::string line = session::FormatJournalLine(seq++, prev, type, record);
    prev = core::Sha256(line);
    journal += line + '\n';
  }
  WriteText(path, journal);
  std::filesystem::remove(session / "manifest.json");
}

// The sensor's size is checked where frames enter, of references too.
TEST_F(HostileUser, FramesOfAnotherSizeAreRefused) {
  ASSERT_EQ(RunLuxfield({"capture", plan_, "s", "--lab", lab_, "--quiet"}, folder_).exit_code, 0);
  // The camera that session.json states is made one column wider, and its hash in the journal
  // mended: every frame is then of another size.
  Json session = core::ReadJson(folder_ / "s/session.json");
  session["camera"]["width"] = session["camera"]["width"].get<int>() + 1;
  session["camera"].erase("vignetting");  // whose size is checked too
  WriteText(folder_ / "s/session.json", session.dump(2) + "\n");
  Reseal(folder_ / "s", core::Sha256OfFile(folder_ / "s/session.json"));
  for (const char* lamp_level : {"monitor", "first-reference"}) {
    const auto outcome =
        RunLuxfield({"merge", "s", "-o", "x.meas.exr", "--lamp-level", lamp_level}, folder_);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.out;
    EXPECT_THAT(outcome.err, HasSubstr("has 84 x 80 pixels, the session's camera has 85 x 80"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "x.meas.exr"));
  }
}

}  // namespace
}  // namespace luxfield::e2e
