"""The audit of chapter 3: every printed equation executed as printed and judged."""


from kr16cli.verify.chapter.records import Equation


