#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/check.hpp"
#include "core/io.hpp"
#include "core/progress.hpp"
#include "core/provenance.hpp"

using namespace hemowalk;
namespace fs = std::filesystem;

namespace {

/// A folder of its own for each test, removed at the end.
class Files : public testing::Test {
 protected:
  Files() : folder(fs::temp_directory_path() / ("hemowalk_io_" + std::to_string(::getpid()))) {
    fs::create_directories(folder);
  }
  ~Files() override { fs::remove_all(folder); }
  std::size_t count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  }
  fs::path folder;
};

}  // namespace

TEST_F(Files, WritingReplacesTheWholeFileAndLeavesNothingBeside) {
  const std::string path = folder / "a" / "b.txt";
  write_file_atomic(path, "one");
  write_file_atomic(path, "two");
  EXPECT_EQ(read_file(path), "two");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "a"), fs::directory_iterator()), 1);
}

TEST_F(Files, WithoutCommitTheOldFileStays) {
  const std::string path = folder / "x";
  write_file_atomic(path, "old");
  {
    AtomicFile file(path);
    std::ofstream(file.temporary()) << "half of the new o";
  }
  EXPECT_EQ(read_file(path), "old");
  EXPECT_EQ(count(), 1u);
}

TEST_F(Files, ErrorsSayWhy) {
  try {
    read_file(folder / "absent");
    FAIL();
  } catch (const IoError& error) {
    EXPECT_NE(std::string(error.what()).find("no such file"), std::string::npos) << error.what();
    EXPECT_EQ(error.code, Exit::io);
  }
  EXPECT_THROW(read_file(folder), IoError);
  EXPECT_THROW(read_input_file(folder / "absent"), InputError);
  EXPECT_THROW(read_input_file(folder), InputError);
  EXPECT_THROW(write_file_atomic(folder / "file" / "x",
                                 (write_file_atomic(folder / "file", "a file, no folder"), "x")),
               IoError);
  write_file_atomic(folder / "long", std::string(1000, 'x'));
  EXPECT_THROW(read_file(folder / "long", 999), IoError);
}

TEST_F(Files, AFullDiskIsAnError) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  AtomicFile file(folder / "x");
  fs::create_symlink("/dev/full", file.temporary());
  EXPECT_THROW(
      {
        std::FILE* f = std::fopen(file.temporary().c_str(), "wb");
        const bool good = f && std::fputs("text", f) >= 0 && std::fclose(f) == 0;
        if (!good) throw_io_error("cannot write", file.temporary());
      },
      IoError);
}

TEST(Sha256, StandardVectors) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST(Provenance, SaysWhatRan) {
  EXPECT_FALSE(version().empty());
  EXPECT_NE(program_description().find(version()), std::string::npos);
  EXPECT_TRUE(commit().empty() || commit().size() == 12) << commit();
}

TEST(Progress, Durations) {
  EXPECT_EQ(format_duration(8.4), "8 s");
  EXPECT_EQ(format_duration(59.6), "1:00");
  EXPECT_EQ(format_duration(727), "12:07");
  EXPECT_EQ(format_duration(5025), "1:23:45");
  EXPECT_EQ(format_duration(std::nan("")), "?");
  EXPECT_EQ(format_duration(-1), "?");
}

TEST(Progress, TimeLeftIsElapsedTimesWhatRemains) {
  EXPECT_EQ(progress_line("run", 0.25, 10, "step 5", 8), "run [##------]  25 %  left 30 s  step 5");
  EXPECT_EQ(progress_line("run", 1, 90, "", 0), "run 100 %  took 1:30");
  EXPECT_EQ(progress_line("run", std::nan(""), 1, "", 0), "run   0 %");
  EXPECT_EQ(progress_line("run", 7, 1, "", 0), "run 100 %  took 1 s");
}

namespace {

struct Recorder {
  double now = 0;
  std::vector<std::string> written;
  Progress::Output output(bool terminal, double interval) {
    return {terminal, [this](const std::string& text) { written.push_back(text); }, [this] { return now; },
            interval};
  }
};

}  // namespace

TEST(Progress, ALogGetsFewLinesAndAlwaysTheLast) {
  Recorder r;
  Progress progress("run", r.output(false, 30));
  for (int i = 1; i <= 1000; ++i) {
    r.now = 0.1 * i;  // 100 s in all: lines at 30, 60, 90 s and at the end
    progress.update(i / 1000.0);
  }
  ASSERT_EQ(r.written.size(), 4u);
  EXPECT_EQ(r.written.back(), "run 100 %  took 1:40\n");
  EXPECT_NE(r.written[0].find("left 1:10"), std::string::npos) << r.written[0];
}

TEST(Progress, ATerminalRedrawsOneLine) {
  Recorder r;
  {
    Progress progress("run", r.output(true, 0.2));
    progress.update(0.1);
    progress.update(0.2);  // too soon
    r.now = 0.3;
    progress.update(0.3);
  }
  ASSERT_EQ(r.written.size(), 3u);
  EXPECT_EQ(r.written[0].front(), '\r');
  EXPECT_EQ(r.written[0].find('\n'), std::string::npos);
  EXPECT_EQ(r.written[2], "\n");  // left unfinished: the shell's prompt gets a line of its own
}
