// Cell numbers against Table 1 of the paper.
#include <gtest/gtest.h>

#include "core/check.hpp"
#include "tests/support/blood_scene.hpp"

using namespace hemowalk;

TEST(PackingCensus, ReproducesTableOneOfThePaper) {
  struct Row {
    double x, y, z;
    int red35, platelets35, red45, platelets45;
  };
  const Row rows[] = {{50, 50, 50, 476, 95, 612, 122},
                      {50, 100, 50, 953, 190, 1225, 245},
                      {50, 500, 50, 4765, 953, 6127, 1225},
                      {50, 1000, 50, 9531, 1906, 12255, 2451},
                      {100, 1000, 100, 38126, 7625, 49020, 9804}};
  for (const Row& row : rows)
    for (const bool high : {false, true}) {
      const auto count = resolved::census(test::blood_scene({row.x, row.y, row.z}, high ? 0.45 : 0.35));
      EXPECT_EQ(count.rbc, high ? row.red45 : row.red35) << row.x << "x" << row.y;
      EXPECT_EQ(count.platelets, high ? row.platelets45 : row.platelets35) << row.x << "x" << row.y;
    }
}

TEST(PackingCensus, CountsPlacementsAndRefusesWhatIsMissing) {
  data::Scene scene = test::blood_scene({20, 20, 20}, 0.35);
  scene.cells.kinds.pop_back();
  EXPECT_THROW(resolved::census(scene), InputError);
  scene.cells.platelets_per_rbc = 0;
  EXPECT_EQ(resolved::census(scene).rbc, 30);
  scene.cells.hematocrit.reset();
  scene.cells.placements.assign(3, {"rbc", {}, {0, 1, 0}, 0});
  EXPECT_EQ(resolved::census(scene).rbc, 3);
}
