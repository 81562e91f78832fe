// Contact forces against their definition: gradient of the energy, equal and opposite, independent of images,
// threads and the age of the neighbour lists.
#include <gtest/gtest.h>
#include <omp.h>

#include "core/check.hpp"
#include "core/random.hpp"
#include "resolved/contact/topology.hpp"
#include "tests/support/contact_bodies.hpp"

using namespace hemowalk;
using namespace hemowalk::contact;
using mesh::Vec3;
using test::ContactBodies;

namespace {

constexpr Law law{1.0, 0.3, 1.0, 0.5};

double uniform(std::uint64_t id, std::uint64_t step) {
  const RandomBits bits = random_bits(11, Stream::test, id, step);
  return uniform_double(bits.word[0], bits.word[1]);
}
mesh::Quaternion turn(std::uint64_t id) {
  return mesh::rotation({uniform(id, 10) - 0.5, uniform(id, 11) - 0.5, uniform(id, 12) - 0.5},
                        6.28 * uniform(id, 13));
}

/// A crowd in a periodic slab: red cells and platelets that touch and slightly overlap.
template <class Real>
ContactBodies<Real> crowd(int cells, const Vec3& box, double squeeze = 0.6) {
  ContactBodies<Real> set;
  const int rbc = set.add_shape(mesh::red_cell(2 * squeeze, 6)),
            platelet = set.add_shape(mesh::platelet(2 * squeeze, 4));
  for (int c = 0; c < cells; ++c) {
    const auto id = static_cast<std::uint64_t>(c);
    set.add(c % 3 ? rbc : platelet,
            {box[0] * uniform(id, 0), 4 + (box[1] - 8) * uniform(id, 1), box[2] * uniform(id, 2)}, turn(id));
  }
  return set;
}

Domain slab(const Vec3& box) { return {{box[0], 0, box[2]}, {Walls::Geometry::slab, 0, box[1], 0, 0, 0}}; }

/// The definition, pair by pair: every vertex against every triangle of every image.
template <class Real>
std::vector<Vec3> brute_force(const ContactBodies<Real>& set, const Domain& domain, const Law& law,
                              double& energy) {
  std::vector<Vec3> force(set.local.size(), Vec3{});
  energy = 0;
  const auto count = static_cast<int>(set.bodies.size());
  for (int b = 0; b < count; ++b) {
    const Topology shape(set.shapes[set.bodies[b].shape]);
    std::vector<Point<double>> x;
    for (std::size_t v = 0; v < set.vertices(b); ++v) {
      const Vec3 p = set.at(b, v);
      x.push_back({p[0], p[1], p[2]});
    }
    for (int a = 0; a < count; ++a)
      for (int i = -1; i <= 1; ++i)
        for (int k = -1; k <= 1; ++k) {
          if ((a == b && i == 0 && k == 0) || (domain.period[0] == 0 && (i || k))) continue;
          for (std::size_t v = 0; v < set.vertices(a); ++v) {
            const Vec3 at = set.at(a, v);
            const Point<double> p{at[0] - i * domain.period[0], at[1], at[2] - k * domain.period[2]};
            Nearest<double> best{0, 0, {}, 1e300};
            std::uint32_t t = 0;
            for (std::uint32_t s = 0; s < shape.triangles.size(); ++s) {
              const Corners& c = shape.triangles[s];
              const auto n = nearest_on_triangle(p, x[c[0]], x[c[1]], x[c[2]]);
              if (n.squared < best.squared) best = n, t = s;
            }
            const bool outside = dot(best.to_point, pseudo_normal(shape, x.data(), t, best.wb, best.wc)) >= 0;
            const double distance = std::sqrt(best.squared), gap = outside ? distance : -distance;
            if (gap >= law.range || gap < -law.depth) continue;
            const double s = 0.5 * law.stiffness * set.shapes[set.bodies[a].shape].area[v],
                         depth = law.range - gap;
            energy += s * depth * depth * depth / (3 * law.range);
            const double push = s * depth * depth / law.range / gap;
            const double f[3] = {push * best.to_point.x, push * best.to_point.y, push * best.to_point.z};
            const Corners& c = shape.triangles[t];
            const double weight[3] = {1 - best.wb - best.wc, best.wb, best.wc};
            for (int d = 0; d < 3; ++d) {
              force[set.bodies[a].first + v][d] += f[d];
              for (int w = 0; w < 3; ++w) force[set.bodies[b].first + c[w]][d] -= weight[w] * f[d];
            }
          }
        }
    if (domain.walls.geometry != Walls::Geometry::slab) continue;
    for (std::size_t v = 0; v < set.vertices(b); ++v) {
      const double below = x[v].y - domain.walls.lower, above = domain.walls.upper - x[v].y;
      const double gap = std::min(below, above);
      if (gap >= law.range) continue;
      const double s = law.stiffness * set.shapes[set.bodies[b].shape].area[v], depth = law.range - gap;
      energy += s * depth * depth * depth / (3 * law.range);
      force[set.bodies[b].first + v][1] += (below < above ? 1 : -1) * s * depth * depth / law.range;
    }
  }
  return force;
}

double largest(const std::vector<Vec3>& f) {
  double result = 0;
  for (const Vec3& v : f)
    for (const double c : v) result = std::max(result, std::abs(c));
  return result;
}

}  // namespace

TEST(ContactForces, AgreeWithEveryVertexAgainstEveryTriangle) {
  const Vec3 box{24, 24, 26};
  ContactBodies<double> set = crowd<double>(14, box);
  auto contact = set.contact(law, slab(box));
  const Summary sum = set.compute(contact);
  double energy;
  const auto reference = brute_force(set, slab(box), law, energy);
  EXPECT_GT(sum.contacts, 200);
  EXPECT_LT(sum.minimum_gap, -0.1);  // the crowd does overlap
  EXPECT_NEAR(sum.energy, energy, 1e-12 * energy);
  const double scale = largest(reference);
  for (std::size_t m = 0; m < reference.size(); ++m) {
    EXPECT_NEAR(set.force[m].x, reference[m][0], 1e-11 * scale);
    EXPECT_NEAR(set.force[m].y, reference[m][1], 1e-11 * scale);
    EXPECT_NEAR(set.force[m].z, reference[m][2], 1e-11 * scale);
  }
}

// Centred differences: error = O(h^2 E''') + O(eps E/h). With h = 1e-5 and forces of order 1e-2 both are <
// 1e-8.
TEST(ContactForces, AreTheGradientOfTheEnergy) {
  ContactBodies<double> set;
  const int rbc = set.add_shape(mesh::red_cell(2, 5)), platelet = set.add_shape(mesh::platelet(2, 3));
  set.add(rbc, {10, 10, 10}, turn(1));
  set.add(platelet, {12.1, 12.6, 9.3}, turn(2));
  set.add(rbc, {10.3, 4.9, 10.2}, mesh::multiply(mesh::rotation({0.2, 0, 1}, 0.1), turn(1)));
  const Domain domain{{0, 0, 0}, {Walls::Geometry::slab, 1.5, 40, 0, 0, 0}};
  auto contact = set.contact(law, domain);
  const Summary sum = set.compute(contact);
  const auto force = set.force;
  ASSERT_GT(sum.contacts, 15);
  ASSERT_GT(sum.wall_contacts, 3);
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);  // two bodies: more threads would only wait
  const double h = 1e-5;
  double scale = 0;
  for (const auto& f : force) scale = std::max({scale, std::abs(f.x), std::abs(f.y), std::abs(f.z)});
  int pressed = 0;
  for (std::size_t m = 0; m < set.local.size(); ++m) {
    double* x[3] = {&set.local[m].x, &set.local[m].y, &set.local[m].z};
    const double f[3] = {force[m].x, force[m].y, force[m].z};
    pressed += f[0] != 0;
    for (int k = 0; k < 3; ++k) {
      const double before = *x[k];
      *x[k] = before + h;
      const double up = set.compute(contact).energy;
      *x[k] = before - h;
      const double down = set.compute(contact).energy;
      *x[k] = before;
      EXPECT_NEAR(f[k], -(up - down) / (2 * h), 1e-6 * scale) << "marker " << m << " axis " << k;
    }
  }
  omp_set_num_threads(threads);
  EXPECT_GT(pressed, 30);
}

template <class Real>
void expect_balance(double tolerance) {
  const Vec3 box{24, 24, 26};
  ContactBodies<Real> set = crowd<Real>(14, box);
  Domain domain = slab(box);
  domain.period = {0, 0, 0};  // the torque of a periodic box has no meaning
  auto contact = set.contact(law, domain);
  const Summary sum = set.compute(contact);
  ASSERT_GT(sum.contacts, 100);
  ASSERT_GT(sum.wall_contacts, 0);
  Vec3 total{}, torque{};
  double size = 0;
  for (std::size_t b = 0; b < set.bodies.size(); ++b)
    for (std::size_t v = 0; v < set.vertices(static_cast<int>(b)); ++v) {
      const Vec3 x = set.at(static_cast<int>(b), v);
      const auto& f = set.force[set.bodies[b].first + v];
      total[0] += f.x, total[1] += f.y, total[2] += f.z;
      size += std::abs(f.x) + std::abs(f.y) + std::abs(f.z);
      torque[0] += x[1] * f.z - x[2] * f.y;
      torque[1] += x[2] * f.x - x[0] * f.z;
      torque[2] += x[0] * f.y - x[1] * f.x;
    }
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(total[k] + sum.wall_force[0][k] + sum.wall_force[1][k], 0, tolerance * size);
  EXPECT_NEAR(torque[1], 0, tolerance * size * 25);  // walls push along y only: no torque about y
}
TEST(ContactForces, CloseBothMomentaDouble) { expect_balance<double>(1e-14); }
TEST(ContactForces, CloseBothMomentaSingle) { expect_balance<float>(2e-7); }

TEST(ContactForces, TorqueOfAPairIsZeroAboutEveryAxis) {
  ContactBodies<double> set;
  const int rbc = set.add_shape(mesh::red_cell(2, 6));
  set.add(rbc, {0, 0, 0}, turn(4));
  set.add(rbc, {1.5, 4.5, 2.5}, turn(5));
  auto contact = set.contact(law);
  ASSERT_GT(set.compute(contact).contacts, 20);
  double torque[3]{}, size = 0;
  for (int b = 0; b < 2; ++b)
    for (std::size_t v = 0; v < set.vertices(b); ++v) {
      const Vec3 x = set.at(b, v);
      const auto& f = set.force[set.bodies[b].first + v];
      torque[0] += x[1] * f.z - x[2] * f.y, torque[1] += x[2] * f.x - x[0] * f.z,
          torque[2] += x[0] * f.y - x[1] * f.x;
      size += std::abs(f.x) + std::abs(f.y) + std::abs(f.z);
    }
  for (const double t : torque) EXPECT_NEAR(t, 0, 1e-14 * 10 * size);
}

// Whole periods may be added to any body, and lattice spacings moved between origin and local coordinates:
// the arithmetic is the same, bit for bit (local coordinates stay multiples of 2^-20 here).
TEST(ContactForces, DoNotDependOnTheImageABodyIsGivenIn) {
  const Vec3 box{24, 24, 26};
  ContactBodies<double> set = crowd<double>(14, box);
  for (auto& p : set.local)
    for (double* c : {&p.x, &p.y, &p.z}) *c = std::round(*c * 1048576) / 1048576;
  auto contact = set.contact(law, slab(box));
  const Summary before = set.compute(contact);
  const auto force = set.force;
  for (std::size_t b = 0; b < set.bodies.size(); ++b) {
    set.origin[b][0] += 24 * (static_cast<int>(b % 3) - 1);
    set.origin[b][2] += 26 * (static_cast<int>(b % 5) * 1000 - 1);
  }
  const Summary after = set.compute(contact);
  EXPECT_EQ(before.contacts, after.contacts);
  EXPECT_NEAR(before.energy, after.energy, 1e-13 * before.energy);  // order of images may differ
  double scale = 0;
  for (const auto& f : force) scale = std::max(scale, std::abs(f.y));
  for (std::size_t m = 0; m < force.size(); ++m) {
    ASSERT_NEAR(force[m].x, set.force[m].x, 1e-13 * scale);
    ASSERT_NEAR(force[m].y, set.force[m].y, 1e-13 * scale);
    ASSERT_NEAR(force[m].z, set.force[m].z, 1e-13 * scale);
  }
}

TEST(ContactForces, AcrossThePeriodAsInTheMiddle) {
  double energy[2];
  for (const int where : {0, 1}) {
    ContactBodies<double> set;
    const int rbc = set.add_shape(mesh::red_cell(2, 6));
    const double x = where ? 0.25 : 20.25, z = where ? 39.75 : 20.75;
    set.add(rbc, {x, 20, z}, turn(4));
    set.add(rbc, {std::fmod(x + 1.5, 40), 24.5, std::fmod(z + 2.5, 40)}, turn(5));
    auto contact = set.contact(law, Domain{{40, 0, 40}, {}});
    const Summary sum = set.compute(contact);
    ASSERT_GT(sum.contacts, 20);
    energy[where] = sum.energy;
  }
  EXPECT_NEAR(energy[0], energy[1], 1e-12 * energy[0]);
}

// A body longer than the box presses against its own image.
TEST(ContactForces, ABodyMeetsItsOwnImage) {
  ContactBodies<double> set;
  set.add(set.add_shape(mesh::ellipsoid({10, 2, 2}, 8)), {5, 5, 5});
  auto contact = set.contact(law, Domain{{20, 0, 20}, {}});  // tips 20 apart in a period of 20: gap 0 dx
  const Summary touching = set.compute(contact);
  EXPECT_GT(touching.contacts, 0);
  double total = 0;
  for (const auto& f : set.force) total += f.x;
  EXPECT_NEAR(total, 0, 1e-14);
  auto wide = set.contact(law, Domain{{22, 0, 20}, {}});
  EXPECT_EQ(set.compute(wide).contacts, 0);
}

// In a box narrower than a body, two bodies meet through several images at once.
TEST(ContactForces, SeveralImagesOfOneBody) {
  ContactBodies<double> set;
  const int rod = set.add_shape(mesh::ellipsoid({10, 2, 2}, 6));
  set.add(rod, {5, 5, 5});
  set.add(rod, {11.3, 8.2, 5.4});
  const Domain domain{{21, 0, 21}, {}};
  auto contact = set.contact(law, domain);
  const Summary sum = set.compute(contact);
  double energy;
  const auto reference = brute_force(set, domain, law, energy);
  ASSERT_GT(sum.contacts, 10);
  EXPECT_NEAR(sum.energy, energy, 1e-12 * energy);
  for (std::size_t m = 0; m < reference.size(); ++m)
    EXPECT_NEAR(set.force[m].y, reference[m][1], 1e-11 * largest(reference));
}

template <class Real>
std::vector<Node4<Real>> forces_with_threads(int threads, double& energy) {
  const int before = omp_get_max_threads();
  omp_set_num_threads(threads);
  const Vec3 box{40, 40, 40};
  ContactBodies<Real> set = crowd<Real>(60, box);
  auto contact = set.contact(law, slab(box));
  energy = set.compute(contact).energy;
  omp_set_num_threads(before);
  return set.force;
}
TEST(ContactForces, AreTheSameBitsForAnyNumberOfThreads) {
  double energy, again;
  const auto one = forces_with_threads<float>(1, energy);
  for (const int threads : {2, 3, 5}) {
    const auto many = forces_with_threads<float>(threads, again);
    EXPECT_EQ(energy, again);
    for (std::size_t m = 0; m < one.size(); ++m)
      ASSERT_TRUE(one[m].x == many[m].x && one[m].y == many[m].y && one[m].z == many[m].z);
  }
}

// Bodies in shear, turning: lists that are kept for many steps give what a fresh search gives, to the bit,
// because a restarted run has no old lists.
TEST(ContactForces, OldNeighbourListsMissNothing) {
  const Vec3 box{24, 24, 26};
  ContactBodies<float> set = crowd<float>(14, box);
  auto kept = set.contact(law, slab(box));
  const int steps = 120;
  for (int n = 0; n < steps; ++n) {
    for (std::size_t b = 0; b < set.bodies.size(); ++b) {
      float c[3]{};
      const std::size_t count = set.vertices(static_cast<int>(b));
      for (std::size_t v = 0; v < count; ++v) {
        const auto& p = set.local[set.bodies[b].first + v];
        c[1] += p.y / static_cast<float>(count), c[2] += p.z / static_cast<float>(count);
      }
      for (std::size_t v = 0; v < count; ++v) {
        auto& p = set.local[set.bodies[b].first + v];
        const float y = p.y - c[1], z = p.z - c[2];
        p.y += -0.003f * z, p.z += 0.003f * y + 0.0015f * (c[1] + static_cast<float>(set.origin[b][1] - 12));
      }
      if (n % 40 == 17)  // the caller may move its origins at any time
        for (std::size_t v = 0; v < count; ++v) set.local[set.bodies[b].first + v].z -= 1;
      if (n % 40 == 17) set.origin[b][2] += 1;
      // Leaving the box on one side and entering on the other is no motion: no reason to search.
      if ((n + static_cast<int>(b)) % 7 == 0) set.origin[b][2] += n % 2 ? 26 : -26;
    }
    const Summary sum = set.compute(kept);
    const auto force = set.force;
    auto fresh = set.contact(law, slab(box));
    const Summary exact = set.compute(fresh);
    ASSERT_EQ(sum.contacts, exact.contacts) << "step " << n;
    ASSERT_EQ(sum.energy, exact.energy);
    for (std::size_t m = 0; m < force.size(); ++m)
      ASSERT_TRUE(set.force[m].x == force[m].x && set.force[m].y == force[m].y &&
                  set.force[m].z == force[m].z);
  }
  EXPECT_GT(kept.searches(), 2);
  EXPECT_LT(kept.searches(), steps / 3);
}

TEST(ContactForces, StridedBodiesAsInSimdLanes) {
  const Vec3 box{24, 24, 26};
  ContactBodies<double> set = crowd<double>(9, box);
  auto contact = set.contact(law, slab(box));
  set.compute(contact);
  // The same bodies, every fifth slot, interleaved.
  ContactBodies<double> lanes = set;
  lanes.local.assign(set.local.size() * 9, {});
  lanes.force.assign(lanes.local.size(), {9, 9, 9, 9});
  for (std::size_t b = 0; b < set.bodies.size(); ++b) {
    lanes.bodies[b].first = static_cast<std::uint32_t>(b);
    lanes.bodies[b].stride = 9;
    for (std::size_t v = 0; v < set.vertices(static_cast<int>(b)); ++v)
      lanes.local[b + 9 * v] = set.local[set.bodies[b].first + v];
  }
  auto strided = lanes.contact(law, slab(box));
  lanes.compute(strided);
  for (std::size_t b = 0; b < set.bodies.size(); ++b)
    for (std::size_t v = 0; v < set.vertices(static_cast<int>(b)); ++v) {
      ASSERT_EQ(lanes.force[b + 9 * v].x, set.force[set.bodies[b].first + v].x);
      ASSERT_EQ(lanes.force[b + 9 * v].z, set.force[set.bodies[b].first + v].z);
    }
  EXPECT_EQ(lanes.force.back().x, 9);  // nobody's slot is left alone
}

// Two ranks that see each other's bodies as copies add up to the whole.
TEST(ContactForces, CopiesOfForeignBodiesCountOnce) {
  const Vec3 box{24, 24, 26};
  ContactBodies<double> set = crowd<double>(12, box);
  auto whole = set.contact(law, slab(box));
  const Summary sum = set.compute(whole);
  const auto force = set.force;
  Summary parts;
  for (const int rank : {0, 1}) {
    ContactBodies<double> part = set;
    for (std::size_t b = 0; b < part.bodies.size(); ++b)
      part.bodies[b].owned = static_cast<int>(b % 2) == rank;
    auto contact = part.contact(law, slab(box));
    const Summary s = part.compute(contact);
    parts.energy += s.energy;
    parts.contacts += s.contacts;
    parts.wall_contacts += s.wall_contacts;
    for (int k = 0; k < 6; ++k) parts.virial[k] += s.virial[k];
    for (std::size_t b = 0; b < part.bodies.size(); ++b)
      for (std::size_t v = 0; part.bodies[b].owned && v < part.vertices(static_cast<int>(b)); ++v) {
        const auto m = part.bodies[b].first + v;
        ASSERT_NEAR(part.force[m].x, force[m].x, 1e-14);
        ASSERT_NEAR(part.force[m].y, force[m].y, 1e-14);
      }
  }
  EXPECT_EQ(parts.contacts, sum.contacts);
  EXPECT_EQ(parts.wall_contacts, sum.wall_contacts);
  EXPECT_NEAR(parts.energy, sum.energy, 1e-12 * sum.energy);
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(parts.virial[k], sum.virial[k], 1e-12 * sum.energy * 10);
}

TEST(ContactForces, BadInputIsAnError) {
  ContactBodies<double> set = crowd<double>(3, {24, 24, 26});
  auto contact = set.contact(law);
  set.local[set.bodies[1].first + 5].y = std::nan("");
  EXPECT_THROW(set.compute(contact), PhysicsError);
  EXPECT_THROW(set.contact(law, Domain{{-10, 0, 0}, {}}), InputError);
  EXPECT_THROW(set.contact(Law{0, 1, 1, 1}), InputError);
}
