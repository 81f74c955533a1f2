// Tells when an element comes near the part of the page that is in sight: what is far away is not drawn.
import type { Attachment } from 'svelte/attachments'

const acts = new WeakMap<Element, (near: boolean) => void>()
let observer: IntersectionObserver | undefined

/** Everything is near where the browser cannot tell. */
export function near(act: (near: boolean) => void): Attachment {
  return (element) => {
    if (typeof IntersectionObserver === 'undefined') return act(true)
    observer ??= new IntersectionObserver(
      (entries) => {
        for (const { target, isIntersecting } of entries) acts.get(target)?.(isIntersecting)
      },
      { rootMargin: '600px 0px' },
    )
    const watching = observer
    acts.set(element, act)
    watching.observe(element)
    return () => watching.unobserve(element)
  }
}
