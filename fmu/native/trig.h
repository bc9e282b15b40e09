/* Sine, cosine and arctangent that are the same on every platform; angles up to KR16_FARTHEST. */
#ifndef KR16_TRIG_H
#define KR16_TRIG_H

double kr16_sin(double angle);
double kr16_cos(double angle);
double kr16_angle(double y, double x);

#endif
