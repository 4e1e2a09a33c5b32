#include "levelset/grid/checkpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"
#include "levelset/motion/advect.h"
#include "levelset/start/shapes.h"
#include "tests/levelset/speeds.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class CheckpointFile : public testing::Test {
 protected:
  std::filesystem::path path() const { return folder_ / "state.vdb"; }

  static Layers etched_wafer() {
    const Frame frame{
        .spacing = 2.5, .cells = {20, 12}, .boundary = {Boundary::periodic, Boundary::reflective}};
    Layers layers = build_layers(
        frame,
        std::vector<Shape>{
            WaferShape{.material = 3},
            MaskShape{.material = 1, .thickness = 10, .outline = CircleOutline{.radius = 11}}});
    const SpeedField field = prescribe_speeds(
        layers, [](Vec3d, MaterialId material) { return material == 3 ? -1.0 : 0.0; });
    advect(layers, field, stable_time_step(layers, field, 0.5));
    return layers;
  }

  TemporaryFolder folder_;
};

// Nobody writes it; where it is waited for the test ends by the signal.
TEST_F(CheckpointFile, APipeIsRefusedAtOnce) {
  ASSERT_EQ(mkfifo(path().c_str(), 0600), 0);
  alarm(10);
  EXPECT_THAT([&] { read_checkpoint(path()); },
              ThrowsMessage<InputError>(HasSubstr("it is a pipe")));
  alarm(0);
}

TEST_F(CheckpointFile, ComesBackBitForBit) {
  const Layers layers = etched_wafer();
  const CheckpointNotes notes{{"time_s", "1.5"}, {"blob", std::string("a\0\n\xff", 4)}};
  write_checkpoint(path(), layers, notes);
  const Checkpoint read = read_checkpoint(path());

  EXPECT_EQ(read.notes, notes);
  EXPECT_EQ(hash(read.layers), hash(layers));
  EXPECT_EQ(read.layers.frame.spacing, layers.frame.spacing);
  EXPECT_EQ(read.layers.frame.cells, layers.frame.cells);
  EXPECT_EQ(read.layers.frame.boundary, layers.frame.boundary);
  ASSERT_EQ(read.layers.stack.size(), 2U);
  for (std::size_t n = 0; n < 2; ++n) {
    EXPECT_EQ(read.layers.stack[n].material, layers.stack[n].material);
    EXPECT_EQ(read.layers.stack[n].phi.active_count(), layers.stack[n].phi.active_count());
  }
}

TEST_F(CheckpointFile, ContinuesAsIfNothingHadHappened) {
  Layers layers = etched_wafer();
  write_checkpoint(path(), layers, {});
  Layers read = std::move(read_checkpoint(path()).layers);
  for (Layers* each : {&layers, &read}) {
    for (int step = 0; step < 3; ++step) {
      const SpeedField field = prescribe_speeds(*each, [](Vec3d r, MaterialId) { return r.x; });
      advect(*each, field, stable_time_step(*each, field, 0.5));
    }
  }
  EXPECT_EQ(hash(read), hash(layers));
}

TEST_F(CheckpointFile, RefusesTruncatedForeignAndMissingFiles) {
  write_checkpoint(path(), etched_wafer(), {});
  const auto size = std::filesystem::file_size(path());
  for (const std::uintmax_t kept :
       {size - 1, size / 2, size / 10, std::uintmax_t{20}, std::uintmax_t{0}}) {
    std::filesystem::resize_file(path(), kept);
    EXPECT_THAT([&] { read_checkpoint(path()); },
                ThrowsMessage<InputError>(HasSubstr("state.vdb: ")))
        << kept << " of " << size << " bytes";
  }
  std::ofstream(path()) << "title = \"a recipe\"\n";
  EXPECT_THAT([&] { read_checkpoint(path()); }, ThrowsMessage<InputError>(HasSubstr("not a")));
  EXPECT_THAT([&] { read_checkpoint(folder_ / "none.vdb"); },
              ThrowsMessage<InputError>(HasSubstr("cannot be read")));
}

TEST_F(CheckpointFile, RefusesChangedBytes) {
  write_checkpoint(path(), etched_wafer(), {});
  const auto size = static_cast<std::streamoff>(std::filesystem::file_size(path()));
  std::fstream file(path(), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(size - 200);
  file.put('\x42');
  file.close();
  EXPECT_THROW(read_checkpoint(path()), InputError);
}

// As a later version would write it, with a hash that is right.
TEST_F(CheckpointFile, RefusesAnotherFormatByItsNumber) {
  write_checkpoint(path(), etched_wafer(), {});
  std::string file = read_file(path());
  const std::size_t type = file.find("int32", file.find("scarp_format"));
  const std::int32_t format = 77;
  std::memcpy(file.data() + type + 9, &format, sizeof format);
  const std::size_t size = file.size() - 24;
  const std::uint64_t hash = XXH3_64bits(file.data(), size);
  std::memcpy(file.data() + size + 16, &hash, sizeof hash);
  std::ofstream(path(), std::ios::binary) << file;
  EXPECT_THAT([&] { read_checkpoint(path()); },
              ThrowsMessage<InputError>(HasSubstr("format 77, this version of scarp reads")));
}

TEST_F(CheckpointFile, LeavesNothingWhereItCannotWrite) {
  EXPECT_THROW(write_checkpoint(folder_ / "no" / "state.vdb", etched_wafer(), {}), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(CheckpointFile, SaysSoWhenTheDiskIsFull) {
  EXPECT_THAT([] { write_checkpoint("/dev/full", etched_wafer(), {}); },
              ThrowsMessage<NumericalError>(HasSubstr("disk is full")));
}

}  // namespace
}  // namespace scarp
