// SPDX-License-Identifier: Apache-2.0
// The vectors, matrices and quaternions of the HDU headers, against formulas written again here.
#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include <HDU/hduMatrix.h>
#include <HDU/hduQuaternion.h>
#include <HDU/hduVector.h>
#include <doctest/doctest.h>

namespace kerf::hdu_test {
namespace {

constexpr double kPi = 3.14159265358979323846;

double off(const hduVector3Dd& a, const hduVector3Dd& b) {
  return a.distance(b);
}

double off(const hduMatrix& a, const hduMatrix& b) {
  double most = 0;
  for (int i = 0; i < 16; ++i) most = std::max(most, std::abs(a[i / 4][i % 4] - b[i / 4][i % 4]));
  return most;
}

hduVector3Dd through(const hduMatrix& m, const hduVector3Dd& v) {
  hduVector3Dd out;
  m.multVecMatrix(v, out);
  return out;
}

}  // namespace

TEST_CASE("HDU's vectors calculate, in place, by numbers of any type and as plain arrays") {
  const hduVector3Dd a(1, -2, 3), b(0.5, 4, -1);
  CHECK(a + b == hduVector3Dd(1.5, 2, 2));
  CHECK(a - b == hduVector3Dd(0.5, -6, 4));
  CHECK(-a == hduVector3Dd(-1, 2, -3));
  CHECK(a * 2 == hduVector3Dd(2, -4, 6));
  CHECK(2 * a == 2.0F * a);
  CHECK(a / 2 == 0.5 * a);
  CHECK(a * 3 - 4 * b + a == hduVector3Dd(2, -24, 16));
  CHECK(a * b == hduVector3Dd(0.5, -8, -3));  // number by number
  CHECK(a.dotProduct(b) == -10.5);
  CHECK(dotProduct(a, b) == -10.5);
  CHECK(a.crossProduct(b) == hduVector3Dd(-10, 2.5, 5));
  CHECK(crossProduct(a, b) == -crossProduct(b, a));
  CHECK(std::abs(a.magnitude() - std::sqrt(14.0)) < 1e-15);
  CHECK(std::abs(normalize(a).magnitude() - 1) < 1e-15);
  CHECK(normalize(hduVector3Dd()) == hduVector3Dd(0, 0, 0));  // and no NaN
  hduVector3Dd c(a);
  (((c += b) -= a) *= 4.0) /= 2;
  CHECK(c == 2 * b);
  CHECK(c.isZero(9));
  CHECK_FALSE(c.isZero(8));
  const hduVector3Df single(a);
  CHECK(single[2] == 3.0F);
  std::ostringstream said;
  said << a;
  CHECK(said.str() == "1 -2 3");

  hduVector3Dd out;
  hduVecSubtract(out, a, b);
  CHECK(out == a - b);
  hduVecAdd(out, out, b);
  CHECK(out == a);
  hduVecScaleInPlace(out, 2);
  CHECK(out == 2 * a);
  hduVecCrossProduct(out, a, b);
  CHECK(out == a.crossProduct(b));
  hduVecNormalize(out, hduVector3Dd());
  CHECK(out == hduVector3Dd());
  CHECK(hduVecDistance(a, b) == a.distance(b));
}

TEST_CASE("HDU's matrices move row vectors, with the translation in their last row") {
  const hduVector3Dd p(1, 2, 3);
  const hduMatrix move = hduMatrix::createTranslation(10, 20, 30);
  CHECK(move[3][0] == 10);
  CHECK(through(move, p) == hduVector3Dd(11, 22, 33));
  CHECK(p * move == hduVector3Dd(11, 22, 33));
  hduVector3Dd direction;
  move.multDirMatrix(p, direction);
  CHECK(direction == p);
  // A quarter turn by the right hand: x to y, y to z, z to x.
  CHECK(off(through(hduMatrix::createRotationAroundZ(kPi / 2), {1, 0, 0}), {0, 1, 0}) < 1e-15);
  CHECK(off(through(hduMatrix::createRotationAroundX(kPi / 2), {0, 1, 0}), {0, 0, 1}) < 1e-15);
  CHECK(off(through(hduMatrix::createRotationAroundY(kPi / 2), {0, 0, 1}), {1, 0, 0}) < 1e-15);
  // The left factor acts first.
  const hduMatrix turn = hduMatrix::createRotationAroundZ(kPi / 2);
  CHECK(off(through(turn * move, {1, 0, 0}), {10, 21, 30}) < 1e-14);
  CHECK(off(through(move * turn, {1, 0, 0}), {-20, 11, 30}) < 1e-14);
  hduMatrix both(turn);
  CHECK(off(both.multRight(move), turn * move) == 0);
  both = turn;
  CHECK(off(both.multLeft(move), move * turn) == 0);
  // As a column vector, M v: the rows' sums.
  const hduMatrix any(1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 10, 0, 0, 0, 0, 1);
  hduVector3Dd column;
  any.multMatrixVec(p, column);
  CHECK(column == hduVector3Dd(14, 32, 53));
  // 16 numbers as hdGetDoublev writes them.
  hduMatrix read;
  double* const numbers = read;
  for (int i = 0; i < 16; ++i) numbers[i] = i;
  CHECK(read[3][0] == 12);
  CHECK(off(hduMatrix(static_cast<const double*>(read)), read) == 0);
  CHECK(read.getTranspose()[0][3] == 12);
}

TEST_CASE(
    "HDU's inverse is one, also where the first pivot is 0, and of a singular matrix there is "
    "none") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-2, 2);
  for (int round = 0; round < 50; ++round) {
    hduMatrix m;
    for (int i = 0; i < 16; ++i) m[i / 4][i % 4] = any(random);
    if (round % 2 == 0) m[0][0] = 0;
    CHECK(off(m * m.getInverse(), hduMatrix()) < 1e-9);
    hduMatrix again(m);
    CHECK(again.invert());
    CHECK(off(again * m, hduMatrix()) < 1e-9);
  }
  hduMatrix flat = hduMatrix::createScale(1, 0, 1);
  CHECK_FALSE(flat.invert());
  CHECK(flat[1][1] == 0);
  CHECK(flat[2][2] == 1);
}

TEST_CASE("HDU's quaternions turn as their matrices do, at every angle") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int round = 0; round < 200; ++round) {
    const hduVector3Dd axis(any(random), any(random), any(random));
    // Up to half a turn, where the first of the four numbers is 0.
    const double angle = round % 4 == 0 ? kPi : kPi * any(random);
    const hduMatrix m = hduMatrix::createRotation(axis, angle);
    hduQuaternion q(m);
    CHECK(std::abs(q.magnitude() - 1) < 1e-12);
    CHECK(q.s() >= 0);  // so that it changes its sign nowhere but at half a turn
    hduMatrix again;
    q.toRotMatrix(again);
    CHECK(off(again, m) < 1e-12);
    const hduVector3Dd w(any(random), any(random), any(random));
    const hduQuaternion turned = q * hduQuaternion(0, w) * q.conjugate();
    CHECK(off(turned.v(), through(m, w)) < 1e-12);
    hduQuaternion(axis, angle).toRotMatrix(again);
    CHECK(off(again, m) < 1e-12);
    const hduQuaternion one = q * 3.0 * (q * 3.0).inverse();
    CHECK(std::abs(one.s() - 1) < 1e-12);
    CHECK(one.v().magnitude() < 1e-12);
    hduVector3Dd found;
    double by = 0;
    q.toAxisAngle(found, by);
    CHECK(off(hduMatrix::createRotation(found, by), m) < 1e-9);
  }
  // Two rotations: the matrix of the first stands to the left, its quaternion to the right.
  const hduMatrix a = hduMatrix::createRotationAroundX(0.7),
                  b = hduMatrix::createRotationAroundZ(-1.1);
  hduMatrix both;
  (hduQuaternion(b) * hduQuaternion(a)).toRotMatrix(both);
  CHECK(off(both, a * b) < 1e-12);
}

TEST_CASE("HDU takes the rotation out of a matrix that moves and scales, also into itself") {
  const hduMatrix turn = hduMatrix::createRotation(1, 2, -1, 0.8);
  hduMatrix m = hduMatrix::createScale(2, 3, 4) * turn * hduMatrix::createTranslation(5, 6, 7);
  m.getRotationMatrix(m);
  CHECK(off(m, turn) < 1e-15);
}

}  // namespace kerf::hdu_test
