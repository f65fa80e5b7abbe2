/* SPDX-License-Identifier: Apache-2.0 */
/* Vectors of three numbers, written by kerf with the names that programs use. */
#ifndef KERF_STAND_IN_HDU_VECTOR_H
#define KERF_STAND_IN_HDU_VECTOR_H

#include <HD/hd.h>
#include <math.h>

#ifdef __cplusplus
#include <ostream>

/* Converts to a pointer to its numbers, so that hdGetDoublev and hdSetDoublev take it. */
template <class T>
class hduVector3D {
 public:
  typedef T EltType;

  hduVector3D() { set(0, 0, 0); }
  hduVector3D(T x, T y, T z) { set(x, y, z); }
  explicit hduVector3D(const T values[3]) { set(values[0], values[1], values[2]); }
  template <class U>
  hduVector3D(const hduVector3D<U>& other) {
    set(static_cast<T>(other[0]), static_cast<T>(other[1]), static_cast<T>(other[2]));
  }

  void set(T x, T y, T z) {
    p_[0] = x;
    p_[1] = y;
    p_[2] = z;
  }
  T& operator[](int i) { return p_[i]; }
  const T& operator[](int i) const { return p_[i]; }
  operator T*() { return p_; }
  operator const T*() const { return p_; }

  hduVector3D& operator+=(const hduVector3D& v) {
    return to(p_[0] + v[0], p_[1] + v[1], p_[2] + v[2]);
  }
  hduVector3D& operator-=(const hduVector3D& v) {
    return to(p_[0] - v[0], p_[1] - v[1], p_[2] - v[2]);
  }
  hduVector3D& operator*=(const hduVector3D& v) {
    return to(p_[0] * v[0], p_[1] * v[1], p_[2] * v[2]);
  }
  hduVector3D& operator/=(const hduVector3D& v) {
    return to(p_[0] / v[0], p_[1] / v[1], p_[2] / v[2]);
  }
  hduVector3D& operator*=(double s) { return to(p_[0] * s, p_[1] * s, p_[2] * s); }
  hduVector3D& operator/=(double s) { return to(p_[0] / s, p_[1] / s, p_[2] / s); }

  T dotProduct(const hduVector3D& v) const { return p_[0] * v[0] + p_[1] * v[1] + p_[2] * v[2]; }
  hduVector3D crossProduct(const hduVector3D& v) const {
    return hduVector3D(p_[1] * v[2] - p_[2] * v[1], p_[2] * v[0] - p_[0] * v[2],
                       p_[0] * v[1] - p_[1] * v[0]);
  }
  double magnitude() const { return sqrt(static_cast<double>(dotProduct(*this))); }
  double distance(const hduVector3D& v) const { return (*this - v).magnitude(); }
  /* To a length of 1; one of length 0 stays. */
  void normalize() {
    const double length = magnitude();
    if (length > 0) *this /= length;
  }
  bool isZero(T epsilon) const {
    return fabs(static_cast<double>(p_[0])) < epsilon &&
           fabs(static_cast<double>(p_[1])) < epsilon && fabs(static_cast<double>(p_[2])) < epsilon;
  }

  friend hduVector3D operator+(hduVector3D a, const hduVector3D& b) { return a += b; }
  friend hduVector3D operator-(hduVector3D a, const hduVector3D& b) { return a -= b; }
  friend hduVector3D operator*(hduVector3D a, const hduVector3D& b) { return a *= b; }
  friend hduVector3D operator/(hduVector3D a, const hduVector3D& b) { return a /= b; }
  friend hduVector3D operator-(const hduVector3D& v) { return hduVector3D(-v[0], -v[1], -v[2]); }
  friend bool operator==(const hduVector3D& a, const hduVector3D& b) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
  }
  friend bool operator!=(const hduVector3D& a, const hduVector3D& b) { return !(a == b); }
  /* By a number of any type, or one would convert to a pointer. */
  template <class S>
  friend hduVector3D operator*(hduVector3D v, S s) {
    return v *= static_cast<double>(s);
  }
  template <class S>
  friend hduVector3D operator*(S s, hduVector3D v) {
    return v *= static_cast<double>(s);
  }
  template <class S>
  friend hduVector3D operator/(hduVector3D v, S s) {
    return v /= static_cast<double>(s);
  }
  friend std::ostream& operator<<(std::ostream& stream, const hduVector3D& v) {
    return stream << v[0] << ' ' << v[1] << ' ' << v[2];
  }

 private:
  template <class S>
  hduVector3D& to(S x, S y, S z) {
    set(static_cast<T>(x), static_cast<T>(y), static_cast<T>(z));
    return *this;
  }

  T p_[3];
};

typedef hduVector3D<float> hduVector3Df;
typedef hduVector3D<double> hduVector3Dd;

template <class T>
T dotProduct(const hduVector3D<T>& a, const hduVector3D<T>& b) {
  return a.dotProduct(b);
}
template <class T>
hduVector3D<T> crossProduct(const hduVector3D<T>& a, const hduVector3D<T>& b) {
  return a.crossProduct(b);
}
template <class T>
hduVector3D<T> normalize(hduVector3D<T> v) {
  v.normalize();
  return v;
}
#else
typedef double hduVector3Dd[3];
typedef float hduVector3Df[3];
#endif

/* The same on plain arrays, as programs in C have it: `out` first, and it may be an argument. */
static inline void hduVecSet(HDdouble out[3], HDdouble x, HDdouble y, HDdouble z) {
  out[0] = x;
  out[1] = y;
  out[2] = z;
}
static inline void hduVecAdd(HDdouble out[3], const HDdouble a[3], const HDdouble b[3]) {
  hduVecSet(out, a[0] + b[0], a[1] + b[1], a[2] + b[2]);
}
static inline void hduVecSubtract(HDdouble out[3], const HDdouble a[3], const HDdouble b[3]) {
  hduVecSet(out, a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}
static inline void hduVecScale(HDdouble out[3], const HDdouble v[3], HDdouble s) {
  hduVecSet(out, v[0] * s, v[1] * s, v[2] * s);
}
static inline void hduVecScaleInPlace(HDdouble v[3], HDdouble s) {
  hduVecScale(v, v, s);
}
static inline HDdouble hduVecDotProduct(const HDdouble a[3], const HDdouble b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static inline void hduVecCrossProduct(HDdouble out[3], const HDdouble a[3], const HDdouble b[3]) {
  hduVecSet(out, a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
}
static inline HDdouble hduVecMagnitude(const HDdouble v[3]) {
  return sqrt(hduVecDotProduct(v, v));
}
static inline HDdouble hduVecDistance(const HDdouble a[3], const HDdouble b[3]) {
  HDdouble way[3];
  hduVecSubtract(way, a, b);
  return hduVecMagnitude(way);
}
/* One of length 0 stays. */
static inline void hduVecNormalize(HDdouble out[3], const HDdouble v[3]) {
  const HDdouble length = hduVecMagnitude(v);
  hduVecScale(out, v, length > 0 ? 1 / length : 1);
}
static inline void hduVecNormalizeInPlace(HDdouble v[3]) {
  hduVecNormalize(v, v);
}
#endif
